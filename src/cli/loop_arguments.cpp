#include "cli/loop_arguments.h"

#include <map>
#include <string>

namespace sinerig::cli {

void add_loop_options(CLI::App& command, LoopOptions& options) {
  command
      .add_option("--controller-num", options.controller_num,
                  "controller's numerator, descending powers of s: C1,C2,...")
      ->delimiter(',');
  command.add_option("--controller-den", options.controller_den, "its denominator")->delimiter(',');
  command
      .add_option("--pid", options.pid,
                  "controller KP,KI,KD[,FILTER_HZ]: KP + KI/s + KD s/(1 + s/(2 pi FILTER_HZ))")
      ->delimiter(',');
  command.add_option("--rate", options.rate_hz,
                     "rate in Hz that the controller runs at, by Tustin behind a zero-order hold; "
                     "0: continuous (default: the loop rate of a sweep file)");
  command
      .add_option(
          "--hold", options.hold_hz,
          "rate in Hz of the zero-order hold that the plant was measured behind, none or 0: "
          "there was none (default: what the file says); the model is made without it")
      ->transform(
          CLI::Transformer{std::map<std::string, std::string>{{"none", "0"}}}.description(""));
  command.add_option("--loop-delay", options.delay_s,
                     "more delay in the loop, seconds: calculation, transport");
}

}  // namespace sinerig::cli
