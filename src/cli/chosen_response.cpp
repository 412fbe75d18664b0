#include "cli/chosen_response.h"

#include <algorithm>

#include <spdlog/spdlog.h>

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
  const auto found =
      std::find_if(run.responses.begin(), run.responses.end(),
                   [&](const auto& each) { return run.channels.at(each.output).name == channel; });
  if (found != run.responses.end()) return *found;
  std::string names;
  for (const auto& each : run.responses) names += " " + run.channels.at(each.output).name;
  throw record::SweepFileError(file + ": has no response of \"" + channel + "\"; it has" + names);
}

}  // namespace sinerig::cli
