#include "cli/run_differences.h"

#include <spdlog/spdlog.h>

namespace sinerig::cli {

namespace {

using record::Difference;
using record::StoredResponse;

const StoredResponse* same_response(const report::LabelledRun& run, const std::string& name) {
  for (const StoredResponse& response : run.run.responses)
    if (report::response_name(run.run, response) == name) return &response;
  return nullptr;
}

}  // namespace

std::vector<Difference> differences_of(const std::vector<report::LabelledRun>& runs,
                                       const record::CompareSettings& settings) {
  std::vector<Difference> differences;
  const report::LabelledRun& first = runs.front();
  for (std::size_t i = 1; i < runs.size(); ++i) {
    for (const StoredResponse& response : first.run.responses) {
      const std::string name = report::response_name(first.run, response);
      const bool single = first.run.responses.size() == 1 && runs[i].run.responses.size() == 1;
      const StoredResponse* other =
          single ? &runs[i].run.responses.front() : same_response(runs[i], name);
      if (other == nullptr) {
        spdlog::warn("{} has no response of {}: not compared", runs[i].label, name);
        continue;
      }
      Difference difference = compare_responses(response, *other, settings);
      difference.file = runs[i].label;
      difference.name = runs[i].label + " " + name;
      differences.push_back(std::move(difference));
    }
  }
  return differences;
}

}  // namespace sinerig::cli
