// A benchmark in parts, each with bounds of its own: chosen by name on the command line, or all.
#pragma once

#include <cstdio>
#include <exception>
#include <span>
#include <string>
#include <vector>

namespace sinerig::bench {

template <class Options>
struct Part {
  const char* name;
  int (*run)(const Options&);  // returns the number of bounds that it missed
};

// What stands on a command line behind the program's name, from front to back.
class Words {
 public:
  Words(int argc, char** argv) : words_(argv + 1, argv + argc) {}
  bool left() const { return next_ < words_.size(); }
  const std::string& peek() const { return words_[next_]; }
  // Throws std::out_of_range at the end.
  const std::string& take() { return words_.at(next_++); }

 private:
  std::vector<std::string> words_;
  std::size_t next_ = 0;
};

// The exit status of main(): 0 when no bound was missed, 2 after a word that nobody knows.
// `option(word, words, options)` takes the values of an option; false where it knows no such word.
template <class Options, class Option>
int run_parts(int argc, char** argv, std::span<const Part<Options>> parts, Options options,
              const Option& option, const char* usage) {
  try {
    std::vector<const Part<Options>*> chosen;
    for (Words words{argc, argv}; words.left();) {
      const std::string word = words.take();
      const auto count = chosen.size();
      for (const Part<Options>& part : parts) {
        if (word == part.name) chosen.push_back(&part);
      }
      if (chosen.size() > count || option(word, words, options)) continue;
      std::fprintf(stderr, "%s: unknown word\n%s", word.c_str(), usage);
      return 2;
    }
    if (chosen.empty()) {
      for (const Part<Options>& part : parts) chosen.push_back(&part);
    }
    int missed = 0;
    for (const Part<Options>* part : chosen) missed += part->run(options);
    std::printf("\n%d bound%s missed\n", missed, missed == 1 ? "" : "s");
    return missed == 0 ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n%s", error.what(), usage);
    return 2;
  }
}

}  // namespace sinerig::bench
