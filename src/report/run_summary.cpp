#include "report/run_summary.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include <nlohmann/json.hpp>

#include "record/confidence.h"
#include "record/text.h"
#include "report/report_data.h"
#include "report/run_parts.h"
#include "report/terminal.h"

namespace sinerig::report {

namespace {

using Json = nlohmann::ordered_json;
using record::StoredPoint;
using record::StoredRun;
using record::text;

// What may stand in a headline; the table shows the others, each with its status.
bool trusted(const StoredPoint& point) {
  return point.status == "good" || point.status == "imported";
}

Json points_fact(const std::vector<StoredPoint>& points, std::size_t planned) {
  const auto good = std::count_if(points.begin(), points.end(), trusted);
  const auto others = static_cast<std::ptrdiff_t>(points.size()) - good;
  const std::string missing =
      points.size() < planned ? text("of %zu planned, ", planned) : std::string{};
  const std::string remark =
      others == 0 ? "all good"
                  : text("%td good, %td not", static_cast<std::ptrdiff_t>(good), others);
  return {"Points", std::to_string(points.size()), missing + remark};
}

// Nothing where every point was settled the same, usual way.
Json transient_fact(const std::vector<StoredPoint>& points) {
  const auto settled_by = [&](const char* way) {
    return std::count_if(points.begin(), points.end(),
                         [&](const StoredPoint& point) { return point.settled_by == way; });
  };
  const auto modelled = settled_by("model");
  if (modelled == 0) return nullptr;
  return {"Transients modelled",
          text("%td of %zu", static_cast<std::ptrdiff_t>(modelled), points.size()),
          text("%td seen to go",
               static_cast<std::ptrdiff_t>(settled_by("detection") + settled_by("fallback") +
                                           settled_by("both")))};
}

Json peak_fact(const StoredRun& run) {
  const record::StoredResponse& response = run.responses.front();
  const StoredPoint* peak = nullptr;
  for (const StoredPoint& point : response.points) {
    if (!trusted(point) || !std::isfinite(std::abs(point.response))) continue;
    if (peak == nullptr || std::abs(point.response) > std::abs(peak->response)) peak = &point;
  }
  if (peak == nullptr) return nullptr;
  return {"Largest gain of " + response_name(run, response),
          text("%.2f dB", 20.0 * std::log10(std::abs(peak->response))),
          text("at %.4g Hz", peak->frequency_hz)};
}

Json interval_fact(const std::vector<StoredPoint>& points) {
  std::vector<double> gains;
  std::vector<double> phases;
  for (const StoredPoint& point : points) {
    const record::HalfWidth95 half = half_width95(point);
    if (!trusted(point) || std::isnan(half.gain)) continue;
    gains.push_back(half.gain * record::db_per_relative);
    phases.push_back(half.phase_rad * record::degrees_per_radian);
  }
  if (gains.empty()) return nullptr;
  const auto middle = [](std::vector<double>& values) {
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), at, values.end());
    return *at;
  };
  return {"95 % interval, median", text("± %.2g dB", middle(gains)),
          text("± %.2g°", middle(phases))};
}

double bench_seconds(const StoredRun& run) {
  std::uint64_t ticks = 0;
  for (const record::StoredTiming& timing : run.timings) ticks += timing.ticks + timing.skipped;
  return run.plan.rate_hz > 0.0 ? static_cast<double>(ticks) / run.plan.rate_hz : 0.0;
}

Json loop_fact(const StoredRun& run) {
  std::uint64_t ticks = 0;
  std::uint64_t skipped = 0;
  std::int64_t latest_ns = 0;
  for (const record::StoredTiming& timing : run.timings) {
    ticks += timing.ticks;
    skipped += timing.skipped;
    latest_ns = std::max(latest_ns, timing.max_lateness_ns);
  }
  const std::string remark =
      text("of %llu ticks skipped%s", static_cast<unsigned long long>(ticks + skipped),
           run.fact("clock") == "virtual"
               ? ", virtual clock"
               : text(", latest %.0f µs", static_cast<double>(latest_ns) * 1e-3).c_str());
  const std::optional<ThreadUsage> usage = run.usage();
  return {"Loop", std::to_string(skipped), usage ? remark + ", " + usage_text(*usage) : remark};
}

Json events_json(const StoredRun& run) {
  Json events = Json::array();
  for (const record::StoredEvent& event : run.events) {
    if (event.kind == "dwell_began") continue;
    std::string words = event.detail;
    if (words.empty() && event.fault != "none") words = event.fault;
    if (words.empty() && event.value != 0.0) words = text("%.6g", event.value);
    events.push_back({{"tick", event.tick},
                      {"dwell", event.dwell},
                      {"kind", event.kind},
                      {"channel", event.channel == 0 ? "" : run.channels.at(event.channel).name},
                      {"text", words}});
  }
  return events;
}

Json timing_json(const StoredRun& run) {
  Json frequencies = Json::array();
  Json latest = Json::array();
  Json faults = Json::array();
  Json switches = Json::array();
  std::vector<std::uint64_t> histogram;
  for (const record::StoredTiming& timing : run.timings) {
    if (timing.dwell >= run.plan.dwells.size()) continue;
    frequencies.push_back(run.plan.dwells[timing.dwell].frequency_hz(run.plan.rate_hz));
    latest.push_back(static_cast<double>(timing.max_lateness_ns) * 1e-3);
    const ThreadUsage usage = timing.usage.value_or(ThreadUsage{});
    faults.push_back(usage.minor_faults + usage.major_faults);
    switches.push_back(usage.involuntary_switches);
    std::istringstream counts{timing.lateness_us};
    std::uint64_t count = 0;
    for (std::size_t bin = 0; counts >> count; ++bin) {
      if (bin >= histogram.size()) histogram.resize(bin + 1);
      histogram[bin] += count;
    }
  }
  return {{"f", frequencies},
          {"late_us", latest},
          {"faults", faults},
          {"switches", switches},
          {"histogram", histogram}};
}

}  // namespace

std::string about_run(const StoredRun& run) {
  std::string when = run.fact("started_utc");
  if (when.size() >= 16) when = when.substr(0, 10) + " " + when.substr(11, 5) + " UTC";
  std::string words = when;
  const auto add = [&](const std::string& piece) {
    if (!piece.empty()) words += (words.empty() ? "" : ", ") + piece;
  };
  if (run.plan.rate_hz > 0.0) add(text("%.6g Hz loop", run.plan.rate_hz));
  if (!run.fact("clock").empty()) add(run.fact("clock") + " clock");
  if (!run.fact("host").empty()) add("on " + run.fact("host"));
  if (!run.fact("sinerig").empty()) add("sinerig " + run.fact("sinerig"));
  if (!run.fact("imported_from").empty()) add("imported from " + run.fact("imported_from"));
  return words;
}

std::string outcome_of(const StoredRun& run) {
  const std::string outcome = run.fact("outcome");
  return outcome.empty() && run.fact("imported_from").empty() ? "not finished" : outcome;
}

std::string outcome_text(const StoredRun& run) {
  const std::string outcome = outcome_of(run);
  const std::string detail = run.fact("outcome_detail");
  return detail.empty() ? outcome : outcome + ": " + detail;
}

Json summary_facts(const StoredRun& run) {
  Json facts = Json::array();
  const auto add = [&](const Json& fact) {
    if (!fact.is_null()) facts.push_back(fact);
  };
  if (!run.responses.empty()) {
    const std::vector<StoredPoint>& points = run.responses.front().points;
    add(points_fact(points, point_count(run.plan)));
    if (!points.empty()) {
      add({"Range", text("%.4g – %.4g Hz", points.front().frequency_hz, points.back().frequency_hz),
           ""});
    }
    add(peak_fact(run));
    add(interval_fact(points));
    add(transient_fact(points));
  }
  const double seconds = bench_seconds(run);
  if (seconds > 0.0) add({"Bench time", duration_text(seconds), ""});
  if (!run.timings.empty()) add(loop_fact(run));
  if (run.parts.size() > 1)
    add({"Parts", std::to_string(run.parts.size()), "interrupted and resumed, see the facts"});
  return facts;
}

Json run_json(const LabelledRun& labelled) {
  const StoredRun& run = labelled.run;
  Json facts = Json::array();
  for (const auto& [key, value] : run.facts) {
    if (key == "rig_text" || value.empty()) continue;
    std::string name = key;
    std::replace(name.begin(), name.end(), '_', ' ');
    std::string text = value;
    std::replace(text.begin(), text.end(), '\n', ';');
    facts.push_back({name, text});
  }
  const std::vector<std::string> parts = part_texts(run);
  for (std::size_t i = 0; i < parts.size(); ++i)
    facts.push_back({"part " + std::to_string(i + 1), parts[i]});
  if (const std::string disk = disk_text(run); !disk.empty()) facts.push_back({"disk", disk});
  return {{"label", labelled.label},          {"facts", facts},
          {"rig_name", run.fact("rig_name")}, {"rig_text", run.fact("rig_text")},
          {"rate_hz", run.plan.rate_hz},      {"events", events_json(run)},
          {"timing", timing_json(run)}};
}

}  // namespace sinerig::report
