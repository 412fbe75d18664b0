#include "dashboard/token.h"

#include <array>
#include <stdexcept>

#include <sys/random.h>

namespace sinerig::dashboard {

std::string random_token() {
  std::array<unsigned char, 16> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw std::runtime_error{"the kernel gives no random numbers for the token of the live page"};
  std::string text;
  for (const unsigned char byte : bytes) {
    constexpr const char* digits = "0123456789abcdef";
    text += digits[byte >> 4U];
    text += digits[byte & 0xFU];
  }
  return text;
}

}  // namespace sinerig::dashboard
