#include "cli/run_differences.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <spdlog/spdlog.h>

#include "record/measured.h"

namespace sinerig::cli {

namespace {

using record::Difference;
using record::StoredResponse;

const StoredResponse* same_response(const report::LabelledRun& run, const std::string& name) {
  for (const StoredResponse& response : run.run.responses)
    if (report::response_name(run.run, response) == name) return &response;
  return nullptr;
}

bool has_point_at(const StoredResponse& response, double frequency_hz) {
  constexpr double same = 1e-6;  // part of a frequency, as compare_responses() matches them
  return std::any_of(response.points.begin(), response.points.end(), [&](const auto& point) {
    return std::abs(point.frequency_hz - frequency_hz) <= same * frequency_hz;
  });
}

}  // namespace

report::LabelledRun with_unmeasured(report::LabelledRun run) {
  const std::string outcome = run.run.fact("outcome");
  if (run.run.plan.dwells.empty() || outcome == "done") return run;
  std::size_t most = 0;
  for (StoredResponse& response : run.run.responses) {
    const std::size_t measured = response.points.size();
    for (const Dwell& dwell : run.run.plan.dwells) {
      for (const Tone& tone : dwell.tones) {
        const double frequency_hz = dwell.tone_hz(tone, run.run.plan.rate_hz);
        if (has_point_at(response, frequency_hz)) continue;
        record::StoredPoint point = record::imported_point();
        point.frequency_hz = frequency_hz;
        point.status = "stopped";
        response.points.push_back(point);
      }
    }
    most = std::max(most, response.points.size() - measured);
    std::stable_sort(response.points.begin(), response.points.end(),
                     [](const auto& a, const auto& b) { return a.frequency_hz < b.frequency_hz; });
  }
  spdlog::warn(
      "{}: its run is not done ({}): {} planned points were not measured and are counted as not "
      "good",
      run.label, outcome.empty() ? "killed, or still going on" : outcome, most);
  return run;
}

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
