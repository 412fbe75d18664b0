// codec_tool FILE.dbc : answers one line for each line of its input, for comparison with other
// programs.
//   decode MESSAGE SIGNAL HEXPAYLOAD        -> value
//   encode MESSAGE SIGNAL HEXPAYLOAD VALUE  -> HEXPAYLOAD
#include <charconv>
#include <cstdio>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include "drivers/can/dbc.h"

namespace {

std::vector<std::uint8_t> bytes_of(const std::string& hex) {
  std::vector<std::uint8_t> bytes(hex.size() / 2);
  for (std::size_t n = 0; n < bytes.size(); ++n)
    std::from_chars(hex.data() + 2 * n, hex.data() + 2 * n + 2, bytes[n], 16);
  return bytes;
}

}  // namespace

int main(int, char** arguments) {
  const auto dbc = sinerig::can::Dbc::read_file(arguments[1]);
  std::string line;
  while (std::getline(std::cin, line)) {
    std::istringstream words(line);
    std::string verb, message, name, hex;
    double value = 0.0;
    words >> verb >> message >> name >> hex;
    std::vector<std::uint8_t> payload = bytes_of(hex);
    const auto binding = dbc.find(message + "." + name);
    if (verb == "decode") {
      std::printf("%.17g\n", sinerig::can::decode(payload, binding.signal->signal));
      continue;
    }
    words >> value;
    sinerig::can::encode(payload, binding.signal->signal, value);
    for (const std::uint8_t byte : payload) std::printf("%02x", byte);
    std::printf("\n");
  }
}
