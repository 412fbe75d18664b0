// modbus_tool PORT : does what each line of its input says with the Modbus server on this machine,
// for comparison with other programs. Answers with a line of its own.
//   write FUNCTION ADDRESS TYPE WORDS BYTES VALUE      (functions 6, 16, 23)  -> value applied
//   read FUNCTION ADDRESS TYPE WORDS BYTES             (functions 3, 4, 23)   -> value
// TYPE int16 … float64; WORDS and BYTES "high_first" or "low_first".
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <map>
#include <sstream>
#include <string>

#include "drivers/modbus/registers.h"
#include "drivers/modbus/transport.h"
#include "drivers/monotonic_time.h"

namespace {

using namespace sinerig::modbus;

constexpr std::int64_t patience_ns = 5'000'000'000;

const std::map<std::string, RegisterType> types{
    {"int16", RegisterType::int16},     {"uint16", RegisterType::uint16},
    {"int32", RegisterType::int32},     {"uint32", RegisterType::uint32},
    {"float32", RegisterType::float32}, {"float64", RegisterType::float64}};

Order order(const std::string& name) {
  return name == "high_first" ? Order::high_first : Order::low_first;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) return 2;
  ConnectionSettings settings;
  settings.host = "127.0.0.1";
  settings.port = std::atoi(arguments[1]);
  Transport transport{settings};
  transport.connect();
  std::string line;
  while (std::getline(std::cin, line)) {
    std::istringstream words{line};
    std::string verb, type, word_order, byte_order;
    int function = 0;
    std::uint16_t address = 0;
    double value = 0.0;
    words >> verb >> function >> address >> type >> word_order >> byte_order >> value;
    const Format format{
        .type = types.at(type), .words = order(word_order), .bytes = order(byte_order)};
    const auto size = static_cast<std::uint16_t>(words_of(format.type));
    Request request;
    request.function = static_cast<Function>(function);
    const bool writes = verb == "write" || function == 23;
    if (writes) {
      // Function 23 on behalf of a reading writes elsewhere.
      request.write_address = verb == "write" ? address : std::uint16_t{65000};
      request.write_count = size;
      value = encode(request.words, format, value);
    }
    if (function != 6 && function != 16) {
      request.read_address = address;
      request.read_count = size;
    }
    std::array<std::uint16_t, max_words> registers{};
    const Answer answer =
        transport.ask(request, sinerig::monotonic_now_ns() + patience_ns, registers);
    if (answer.outcome != Outcome::ok) {
      std::printf("failed: %s\n", transport.describe(answer).c_str());
      continue;
    }
    std::printf("%.17g\n", verb == "write" ? value : decode(registers, format));
  }
}
