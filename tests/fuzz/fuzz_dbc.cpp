// Whatever a DBC file holds, the reader accepts it or throws; what it accepts can be bound and
// used.
#include <cstdint>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "drivers/can/dbc.h"
#include "drivers/can/frame_pattern.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sinerig::can;
  try {
    const Dbc dbc = Dbc::read_text({reinterpret_cast<const char*>(data), size}, "fuzz.dbc");
    for (const DbcMessage& message : dbc.messages()) {
      std::vector<std::uint8_t> payload(message.length);
      for (const DbcSignal& signal : message.signals) {
        encode(payload, signal.signal, decode(payload, signal.signal) + 1.0);
        try {
          const DbcBinding binding = dbc.find(message.name + "." + signal.name);
          Pattern pattern;
          for (const auto& [multiplexor, raw] : binding.multiplexors)
            pattern.require(multiplexor->signal, raw);
        } catch (const std::runtime_error&) {
        }
      }
    }
  } catch (const std::runtime_error&) {
  }
  return 0;
}
