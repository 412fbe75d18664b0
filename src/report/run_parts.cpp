#include "report/run_parts.h"

#include <algorithm>
#include <cstdio>

namespace sinerig::report {

std::vector<std::string> part_texts(const record::StoredRun& run) {
  if (run.parts.size() < 2) return {};
  std::vector<std::string> texts;
  for (const record::StoredPart& part : run.parts) {
    std::string words = part.started_utc;
    if (!part.finished_utc.empty()) words += " to " + part.finished_utc;
    words += ", from dwell " + std::to_string(part.first_dwell + 1) + ": " +
             (part.outcome.empty() ? "not finished" : part.outcome);
    if (!part.detail.empty()) words += ", " + part.detail;
    texts.push_back(words);
  }
  return texts;
}

std::string disk_text(const record::StoredRun& run) {
  if (run.lag_s.empty()) return {};
  double most_s = 0.0;
  std::size_t late = 0;
  for (const auto& [dwell, lag_s] : run.lag_s) {
    most_s = std::max(most_s, lag_s);
    const auto next =
        std::find_if(run.timings.begin(), run.timings.end(),
                     [id = dwell + 1](const auto& timing) { return timing.dwell == id; });
    if (next == run.timings.end()) continue;
    const double next_s = static_cast<double>(next->ticks + next->skipped) / run.plan.rate_hz;
    if (lag_s > next_s) ++late;
  }
  char text[160];
  std::snprintf(text, sizeof text, "every point was on the disk %.3g s after its dwell at most",
                most_s);
  if (late == 0) return text;
  return text + (", " + std::to_string(late)) + " of them after the next dwell had ended";
}

}  // namespace sinerig::report
