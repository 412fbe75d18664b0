#include "dashboard/live_json.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>

#include "record/confidence.h"
#include "record/stored_point.h"
#include "report/report_data.h"
#include "report/run_summary.h"

namespace sinerig::dashboard {

using report::rounded;

namespace {

Json event_row(std::uint64_t tick, std::uint32_t dwell, EventKind kind, const std::string& channel,
               const std::string& words) {
  return {{"tick", tick},
          {"dwell", dwell},
          {"kind", to_string(kind)},
          {"channel", channel},
          {"text", words}};
}

Json event_json(const Note& note) {
  return event_row(note.tick, note.dwell, note.kind, "", note.text.data());
}

Json event_json(const Preflight& preflight, const record::StoredRun& run) {
  std::vector<std::string> names;
  for (const record::ChannelInfo& channel : run.channels) names.push_back(channel.name);
  return event_row(preflight.tick, preflight.dwell, EventKind::preflight,
                   names.at(preflight.output), describe(preflight, names));
}

Json event_json(const Event& event, const record::StoredRun& run) {
  std::string words;
  if (event.trip.tripped()) {
    std::vector<std::string> sensors;
    for (std::size_t i = first_sensor_channel; i < run.channels.size(); ++i)
      sensors.push_back(run.channels[i].name);
    words = describe(event.trip, sensors);
  } else if (event.fault != Fault::none) {
    words = to_string(event.fault);
  } else if (event.value != 0.0) {
    words = rounded(event.value, 6).dump();
  }
  const bool of_channel = event.channel > 0 && event.channel < run.channels.size();
  return event_row(event.tick, event.dwell, event.kind,
                   of_channel ? run.channels[event.channel].name : "", words);
}

}  // namespace

std::string text_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Json head_json(const std::string& label, const record::StoredRun& run, const std::string& id,
               bool in_real_time) {
  Json page = report::page_of_run({.label = label, .run = run});
  page["kind"] = "live";
  page["id"] = id;
  page["outcome"] = page["outcome_text"] = "";
  page["summary"] = Json::array();
  double low = unlimited;
  double high = 0.0;
  for (const Dwell& dwell : run.plan.dwells) {
    for (const Tone& tone : dwell.tones) {
      low = std::min(low, dwell.tone_hz(tone, run.plan.rate_hz));
      high = std::max(high, dwell.tone_hz(tone, run.plan.rate_hz));
    }
  }
  page["range"] = {rounded(low, 9), rounded(high, 9)};
  page["dwells"] = run.plan.dwells.size();
  if (!run.plan.probe.command.empty())
    page["probe"] = {rounded(run.plan.probe.low_hz, 4), rounded(run.plan.probe.high_hz, 4)};
  page["least_s"] = rounded(run.plan.min_seconds(), 6);
  page["most_s"] = rounded(run.plan.max_seconds(), 6);
  page["real_time"] = in_real_time;
  page["channels"] = Json::array();
  for (const record::ChannelInfo& channel : run.channels)
    page["channels"].push_back({{"name", channel.name}, {"unit", channel.unit}});
  page["pairs"] = Json::array();
  for (const record::StoredResponse& response : run.responses)
    page["pairs"].push_back({response.input, response.output});
  return page;
}

Json log_json(const std::vector<Record>& entries, const record::StoredRun& run,
              const std::vector<Dwell>& added) {
  std::map<std::uint16_t, std::vector<record::StoredPoint>> points;
  std::vector<std::uint64_t> histogram(DwellTiming::bins);
  Json frequencies = Json::array();
  Json latest = Json::array();
  Json faults = Json::array();
  Json switches = Json::array();
  Json events = Json::array();
  for (const Record& entry : entries) {
    if (const auto* point = std::get_if<Point>(&entry)) {
      points[point->pair].push_back(record::stored_point(*point, run.plan.rate_hz));
    } else if (const auto* timing = std::get_if<DwellTiming>(&entry)) {
      const std::size_t planned = run.plan.dwells.size();
      if (timing->dwell < planned + added.size()) {
        const Dwell& dwell = timing->dwell < planned ? run.plan.dwells[timing->dwell]
                                                     : added[timing->dwell - planned];
        frequencies.push_back(rounded(dwell.frequency_hz(run.plan.rate_hz), 9));
        latest.push_back(rounded(1e-3 * static_cast<double>(timing->max_lateness_ns), 4));
        const ThreadUsage usage = timing->usage.value_or(ThreadUsage{});
        faults.push_back(usage.minor_faults + usage.major_faults);
        switches.push_back(usage.involuntary_switches);
      }
      for (std::size_t bin = 0; bin < histogram.size(); ++bin)
        histogram[bin] += timing->lateness[bin];
    } else if (const auto* event = std::get_if<Event>(&entry)) {
      events.push_back(event_json(*event, run));
    } else if (const auto* preflight = std::get_if<Preflight>(&entry)) {
      events.push_back(event_json(*preflight, run));
    } else if (const auto* note = std::get_if<Note>(&entry)) {
      events.push_back(event_json(*note));
    }
  }
  Json responses = Json::array();
  for (const auto& [pair, columns] : points) {
    Json json = report::point_columns(columns);
    json["r"] = pair;
    responses.push_back(json);
  }
  return {{"responses", responses},
          {"timing",
           {{"f", frequencies},
            {"late_us", latest},
            {"faults", faults},
            {"switches", switches},
            {"histogram", histogram}}},
          {"events", events}};
}

Json headroom_json(const std::vector<Headroom>& rows) {
  Json all = Json::array();
  for (const Headroom& row : rows) {
    const double nothing = std::nan("");
    all.push_back({{"name", row.name},
                   {"unit", row.unit},
                   {"min", rounded(row.min, 6)},
                   {"max", rounded(row.max, 6)},
                   {"low", rounded(row.seen ? row.low : nothing, 5)},
                   {"high", rounded(row.seen ? row.high : nothing, 5)},
                   {"lasting_s", rounded(row.lasting_s, 6)},
                   {"left", rounded(row.left(), 4)},
                   {"used", rounded(row.used(), 4)}});
  }
  return all;
}

Json trace_json(const Scope::Trace& trace) {
  Json channels = Json::array();
  for (const std::vector<double>& channel : trace.channels) {
    Json values = Json::array();
    for (const double value : channel) values.push_back(rounded(value, 5));
    channels.push_back(std::move(values));
  }
  return {{"step_s", rounded(trace.step_s, 9)}, {"channels", channels}};
}

Json estimate_json(const std::optional<RunningEstimate::Value>& value) {
  if (!value) return nullptr;
  return {{"blocks", value->blocks},
          {"re", rounded(value->response.real(), 8)},
          {"im", rounded(value->response.imag(), 8)},
          {"gain95_db", rounded(value->gain_interval_db, 4)},
          {"phase95_deg", rounded(value->phase_interval_deg, 4)}};
}

}  // namespace sinerig::dashboard
