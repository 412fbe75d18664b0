#include "record/exporters.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <ostream>

#include <nlohmann/json.hpp>

#include "record/csv_text.h"
#include "record/point_columns.h"

namespace sinerig::record {

namespace {

using Json = nlohmann::ordered_json;

constexpr double degrees_per_radian = 180.0 / std::numbers::pi;

double gain_db(std::complex<double> response) {
  return 20.0 * std::log10(std::abs(response));
}

std::string field(double value) {
  if (std::isnan(value)) return {};
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

Json plan_json(const SweepPlan& plan) {
  Json dwells = Json::array();
  for (const Dwell& dwell : plan.dwells) {
    Json tones = Json::array();
    for (const Tone& tone : dwell.tones) {
      tones.push_back({{"freq_hz", dwell.tone_hz(tone, plan.rate_hz)},
                       {"cycles", tone.cycles},
                       {"amplitude", tone.amplitude},
                       {"phase_rad", tone.phase_rad}});
    }
    dwells.push_back({{"asked_hz", dwell.asked_hz},
                      {"block_samples", dwell.block_samples},
                      {"ramp_samples", dwell.ramp_samples},
                      {"settle_samples", dwell.settle_samples},
                      {"blocks", dwell.blocks},
                      {"max_samples", dwell.max_samples},
                      {"tones", tones}});
  }
  return dwells;
}

Json response_json(const StoredRun& run, const StoredResponse& response) {
  const std::vector<double> phase = unwrapped_phase(response.points);
  Json points = Json::array();
  for (std::size_t i = 0; i < response.points.size(); ++i) {
    const StoredPoint& point = response.points[i];
    points.push_back({{"freq_hz", point.frequency_hz},
                      {"re", point.response.real()},
                      {"im", point.response.imag()},
                      {"gain_db", gain_db(point.response)},
                      {"phase_deg", phase[i] * degrees_per_radian},
                      {"var_re", point.covariance.re_re},
                      {"cov_re_im", point.covariance.re_im},
                      {"var_im", point.covariance.im_im},
                      {"dof", point.dof},
                      {"gain_interval_db", point.gain_interval_db},
                      {"phase_interval_deg", point.phase_interval_deg},
                      {"input_amplitude", point.input_amplitude},
                      {"output_amplitude", point.output_amplitude},
                      {"snr_db", point.snr_db},
                      {"coherence", point.coherence},
                      {"distortion", point.distortion},
                      {"drift_per_s", point.drift_per_s},
                      {"samples", point.samples},
                      {"lost", point.lost},
                      {"seconds", point.seconds},
                      {"dwell", point.dwell},
                      {"status", point.status},
                      {"reason", point.reason},
                      {"reason_value", point.reason_value},
                      {"settled_by", point.settled_by}});
  }
  const ChannelInfo& input = run.channels.at(response.input);
  const ChannelInfo& output = run.channels.at(response.output);
  return {{"input", input.name},
          {"output", output.name},
          {"input_unit", input.unit},
          {"output_unit", output.unit},
          {"points", points}};
}

Json events_json(const StoredRun& run) {
  Json events = Json::array();
  for (const StoredEvent& event : run.events) {
    Json row = {{"tick", event.tick}, {"dwell", event.dwell}, {"kind", event.kind}};
    if (event.channel != 0) row["channel"] = run.channels.at(event.channel).name;
    if (event.fault != "none") row["fault"] = event.fault;
    if (event.value != 0.0) row["value"] = event.value;
    if (!event.detail.empty()) row["detail"] = event.detail;
    events.push_back(std::move(row));
  }
  return events;
}

Json parts_json(const StoredRun& run) {
  Json parts = Json::array();
  for (const StoredPart& part : run.parts) {
    Json row = {{"started_utc", part.started_utc},
                {"first_dwell", part.first_dwell},
                {"first_tick", part.first_tick}};
    if (!part.finished_utc.empty()) row["finished_utc"] = part.finished_utc;
    if (!part.outcome.empty()) row["outcome"] = part.outcome;
    if (!part.detail.empty()) row["detail"] = part.detail;
    parts.push_back(std::move(row));
  }
  return parts;
}

Json timing_json(const StoredRun& run) {
  Json timings = Json::array();
  for (const StoredTiming& timing : run.timings) {
    const auto usage = [&](std::uint64_t ThreadUsage::*count) {
      return timing.usage ? Json(*timing.usage.*count) : Json(nullptr);
    };
    timings.push_back({{"dwell", timing.dwell},
                       {"first_tick", timing.first_tick},
                       {"ticks", timing.ticks},
                       {"skipped", timing.skipped},
                       {"resettles", timing.resettles},
                       {"max_lateness_ns", timing.max_lateness_ns},
                       {"lateness_us", timing.lateness_us},
                       {"minor_faults", usage(&ThreadUsage::minor_faults)},
                       {"major_faults", usage(&ThreadUsage::major_faults)},
                       {"involuntary_switches", usage(&ThreadUsage::involuntary_switches)}});
    const auto lag = run.lag_s.find(timing.dwell);
    if (lag != run.lag_s.end()) timings.back()["durable_after_s"] = lag->second;
  }
  return timings;
}

// What the names of the columns leave open, as the last name, over a column that says what Y/U is:
// a line of its own would be a row, or an error, to most programs that read CSV, and an empty
// column is one to Octave's importdata. No comma in it, which would end it.
std::string legend(const ChannelInfo& input, const ChannelInfo& output) {
  const auto unit = [](const ChannelInfo& channel) {
    return channel.unit.empty() ? "1" : channel.unit;
  };
  std::string text = std::string{response_convention} + "; re and im in " + unit(output) + " per " +
                     unit(input) + "; intervals are half widths of 95 %";
  return as_field(text);
}

}  // namespace

void write_csv(std::ostream& stream, const StoredRun& run, const StoredResponse& response) {
  const ChannelInfo& input = run.channels.at(response.input);
  const ChannelInfo& output = run.channels.at(response.output);
  stream << "freq_hz,re,im,gain_db,phase_deg,var_re,cov_re_im,var_im";
  for (const PointColumn& column : point_columns) stream << ',' << column.name;
  stream << ",status,reason,settled_by,input,output,input_unit,output_unit,";
  // Left out where it is not known: Octave's importdata takes an empty column for an error.
  const bool held = response.hold_rate_hz > 0.0;
  if (held) stream << "hold_rate_hz,";
  stream << legend(input, output) << '\n';
  const std::vector<double> phase = unwrapped_phase(response.points);
  for (std::size_t i = 0; i < response.points.size(); ++i) {
    const StoredPoint& point = response.points[i];
    for (const double value :
         {point.frequency_hz, point.response.real(), point.response.imag(), gain_db(point.response),
          phase[i] * degrees_per_radian, point.covariance.re_re, point.covariance.re_im,
          point.covariance.im_im}) {
      stream << field(value) << ',';
    }
    for (const PointColumn& column : point_columns) stream << field(point.*column.value) << ',';
    stream << point.status << ',' << point.reason << ',' << point.settled_by << ','
           << as_field(input.name) << ',' << as_field(output.name) << ',' << as_field(input.unit)
           << ',' << as_field(output.unit) << ',';
    if (held) stream << field(response.hold_rate_hz) << ',';
    stream << as_field(output.name) << '/' << as_field(input.name) << '\n';
  }
}

// nlohmann writes NaN and infinity as null.
void write_json(std::ostream& stream, const StoredRun& run) {
  Json facts;
  for (const auto& [key, value] : run.facts) {
    if (key != "rig_text" && key != "rig_name" && key != "rate_hz") facts[key] = value;
  }
  Json channels = Json::array();
  for (const ChannelInfo& channel : run.channels) {
    channels.push_back({{"name", channel.name}, {"unit", channel.unit}});
  }
  Json responses = Json::array();
  for (const StoredResponse& response : run.responses)
    responses.push_back(response_json(run, response));
  const Json document = {{"format", "sinerig-sweep"},
                         {"format_version", 1},
                         {"rate_hz", run.plan.rate_hz},
                         {"convention", response_convention},
                         {"rig", {{"name", run.fact("rig_name")}, {"text", run.fact("rig_text")}}},
                         {"run", facts},
                         {"channels", channels},
                         {"plan", plan_json(run.plan)},
                         {"responses", responses},
                         {"events", events_json(run)},
                         {"parts", parts_json(run)},
                         {"timing", timing_json(run)}};
  // What is no UTF-8 is replaced: a name that cannot be printed is worth no refusal.
  stream << document.dump(1, ' ', false, Json::error_handler_t::replace) << '\n';
}

}  // namespace sinerig::record
