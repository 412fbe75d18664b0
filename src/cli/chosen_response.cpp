#include "cli/chosen_response.h"

#include <algorithm>

#include <spdlog/spdlog.h>

#include "cli/measured_run.h"

namespace sinerig::cli {

const record::StoredResponse& chosen_response(const record::StoredRun& run, const std::string& file,
                                              const std::string& channel) {
  if (run.responses.empty()) {
    throw record::SweepFileError(file + ": holds no finished point yet");
  }
  if (channel.empty()) {
    if (run.responses.size() > 1) {
      spdlog::info("taking {} only, the first of {}; --channel chooses another",
                   run.channels.at(run.responses.front().output).name, run.responses.size());
    }
    return run.responses.front();
  }
  const auto found = std::find_if(run.responses.begin(), run.responses.end(),
                                  [&](const auto& each) { return is_named(run, each, channel); });
  if (found != run.responses.end()) return *found;
  throw record::SweepFileError(file + ": has no response of \"" + channel + "\"; it has" +
                               names_of_responses(run));
}

}  // namespace sinerig::cli
