#include "config/misspelt.h"

#include <algorithm>
#include <cctype>
#include <iterator>
#include <string>

namespace sinerig::config {

bool is_misspelt(std::string_view word, std::string_view wanted) {
  std::string a;
  std::string b;
  const auto lower = [](char each) {
    return static_cast<char>(std::tolower(static_cast<unsigned char>(each)));
  };
  std::transform(word.begin(), word.end(), std::back_inserter(a), lower);
  std::transform(wanted.begin(), wanted.end(), std::back_inserter(b), lower);
  if (a == b) return word != wanted;
  constexpr std::size_t shortest = 3;
  constexpr std::size_t short_word = 4;  // of which one letter makes another: bias and bits
  if (wanted.size() < shortest) return false;
  while (!a.empty() && !b.empty() && a.back() == b.back()) {
    a.pop_back();
    b.pop_back();
  }
  std::size_t same = 0;
  while (same < a.size() && same < b.size() && a[same] == b[same]) ++same;
  a.erase(0, same);
  b.erase(0, same);
  if (a.size() + b.size() == 1) return true;
  if (a.size() == 1 && b.size() == 1) return wanted.size() > short_word;
  return a.size() == 2 && b.size() == 2 && a[0] == b[1] && a[1] == b[0];
}

}  // namespace sinerig::config
