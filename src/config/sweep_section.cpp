#include "config/sweep_section.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "sweep/asked_frequencies.h"

namespace sinerig::config {

namespace {

// Where the wait is fixed and nothing is said of its length.
constexpr Span default_fixed_wait{.cycles = 4.0, .seconds = 0.5};

Range below_half(double rate_hz) {
  return {.min = 0.0, .max = rate_hz / 2.0, .open_min = true, .open_max = true};
}

double read_frequency(const Section& sweep, std::string_view key, double rate_hz) {
  const double frequency_hz = sweep.number(key, above_zero);
  if (!below_half(rate_hz).contains(frequency_hz)) {
    std::ostringstream rule;
    rule << "must be below half the loop rate (" << rate_hz / 2.0 << " Hz)";
    sweep.refuse(key, rule.str());
  }
  return frequency_hz;
}

constexpr Range point_count{.min = 1, .max = 100'000};

void read_sub_band_table(const Section& section, double rate_hz, SweepSettings& sweep) {
  for (const auto& row : section.rows("sub_band_table", above_zero)) {
    if (row.size() != 3)
      section.refuse("sub_band_table", "each row must be [start_hz, stop_hz, points]");
    if (!below_half(rate_hz).contains(row[0]) || !below_half(rate_hz).contains(row[1]))
      section.refuse("sub_band_table", "frequencies must be below half the loop rate");
    if (!point_count.contains(row[2]) || row[2] != std::floor(row[2]))
      section.refuse("sub_band_table", "points must be a whole number, 1 to 100000");
    if (row[2] > 1.0 && row[0] == row[1])
      section.refuse("sub_band_table",
                     "stop_hz must differ from start_hz in a row of several points");
    sweep.sub_bands.push_back(
        {.start_hz = row[0], .stop_hz = row[1], .points = static_cast<std::uint32_t>(row[2])});
  }
  if (sweep.sub_bands.empty()) section.refuse("sub_band_table", "must have a row");
}

void read_frequencies(const Section& section, double rate_hz, SweepSettings& sweep) {
  const std::string spacing = section.choice("spacing", {"logarithmic", "linear", "list"});
  if (spacing == "list") {
    sweep.spacing = Spacing::list;
    sweep.frequencies_hz = section.numbers("frequencies_hz", below_half(rate_hz));
    if (sweep.frequencies_hz.empty()) section.refuse("frequencies_hz", "must hold at least one");
    return;
  }
  sweep.spacing = spacing == "linear" ? Spacing::linear : Spacing::logarithmic;
  if (section.has("sub_band_table")) {
    read_sub_band_table(section, rate_hz, sweep);
    return;
  }
  sweep.start_hz = read_frequency(section, "start_hz", rate_hz);
  sweep.stop_hz = read_frequency(section, "stop_hz", rate_hz);
  sweep.points = static_cast<std::uint32_t>(section.integer("points", point_count));
  if (sweep.points > 1 && sweep.start_hz == sweep.stop_hz) {
    section.refuse("stop_hz", "must differ from start_hz when there is more than one point");
  }
  const auto sub_bands =
      static_cast<std::uint32_t>(section.integer("sub_bands", {.min = 1, .max = 100}, 1));
  if (sub_bands > 1) sweep.sub_bands = equal_sub_bands(sweep, sub_bands);
}

void read_amplitude(const Section& section, SweepSettings& sweep) {
  if (section.has("amplitude_table")) {
    if (section.has("amplitude")) {
      section.refuse("amplitude_table", "stands in place of amplitude; give one of the two");
    }
    for (const std::vector<double>& row : section.rows("amplitude_table", above_zero)) {
      if (row.size() != 2)
        section.refuse("amplitude_table", "every row is [frequency_hz, amplitude]");
      if (!sweep.amplitude_table.empty() && row[0] <= sweep.amplitude_table.back().frequency_hz) {
        section.refuse("amplitude_table", "the frequencies must rise");
      }
      sweep.amplitude_table.push_back({.frequency_hz = row[0], .amplitude = row[1]});
    }
    if (sweep.amplitude_table.empty()) section.refuse("amplitude_table", "must have a row");
  } else {
    sweep.amplitude = section.number("amplitude", above_zero);
  }
  sweep.follow_velocity = section.number("follow_velocity", above_zero_or_unlimited, unlimited);
  sweep.follow_acceleration =
      section.number("follow_acceleration", above_zero_or_unlimited, unlimited);
}

Span read_span(const Section& section, const std::string& name, Span fallback, Range range) {
  return {.cycles = section.number(name + "_cycles", range, fallback.cycles),
          .seconds = section.number(name + "_s", zero_or_more, fallback.seconds)};
}

Level read_level(const Section& section) {
  Level level;
  level.response = section.number("level", zero_or_more, level.response);
  if (!level.wanted()) return level;
  level.most_response = section.number("level_max", above_zero, 3.0 * level.response);
  if (level.most_response < level.response) section.refuse("level_max", "must not be below level");
  level.least_amplitude = section.number("amplitude_min", above_zero);
  level.retries = static_cast<std::uint32_t>(
      section.integer("retries", {.min = 0.0, .max = 10.0}, level.retries));
  return level;
}

Settling read_settling(const Section& section, const SweepSettings& sweep) {
  const std::string name = section.choice("settling", {"detect", "fixed", "model"});
  if (name == "fixed") return Settling::fixed;
  if (name == "detect") return Settling::detect;
  if (sweep.tones > 1) {
    section.refuse("settling",
                   "\"model\" measures one tone at a time; set tones = 1 or \"detect\"");
  }
  if (sweep.bias_amplitude > 0.0) {
    section.refuse("settling",
                   "\"model\" knows no bias motion; set bias_amplitude = 0 or \"detect\"");
  }
  return Settling::model;
}

}  // namespace

SweepSettings read_sweep(const Section& section, double rate_hz) {
  SweepSettings sweep;
  read_frequencies(section, rate_hz, sweep);
  sweep.frequency_tolerance =
      section.number("frequency_tolerance", {.min = 1e-9, .max = 0.1}, sweep.frequency_tolerance);
  sweep.tones =
      static_cast<std::uint32_t>(section.integer("tones", {.min = 1.0, .max = 16.0}, sweep.tones));
  sweep.tones_tolerance =
      section.number("tones_tolerance", {.min = 1e-6, .max = 0.2}, sweep.tones_tolerance);
  sweep.odd_bins = section.flag("odd_bins", sweep.odd_bins);
  sweep.refine_points = static_cast<std::uint32_t>(
      section.integer("refine_points", {.min = 0.0, .max = 10'000.0}, sweep.refine_points));
  sweep.refine_db = section.number("refine_db", {.min = 0.001, .max = 60.0}, sweep.refine_db);
  read_amplitude(section, sweep);
  sweep.level = read_level(section);
  sweep.offset = section.number("offset", any_number, sweep.offset);
  sweep.bias_amplitude = section.number("bias_amplitude", zero_or_more, sweep.bias_amplitude);
  if (sweep.bias_amplitude > 0.0) sweep.bias_hz = read_frequency(section, "bias_hz", rate_hz);
  sweep.ramp_s = section.number("ramp_s", {.min = 0.0, .max = 3600.0}, sweep.ramp_s);
  sweep.settling = read_settling(section, sweep);
  sweep.probe_s = section.number("probe_s", {.min = -1.0, .max = 3600.0}, sweep.probe_s);
  sweep.check_fraction = section.number("check_fraction", fraction_of_one, sweep.check_fraction);
  if (sweep.settling == Settling::fixed) sweep.settle = default_fixed_wait;
  sweep.settle = read_span(section, "settle", sweep.settle, zero_or_more);
  sweep.settle_max = read_span(section, "settle_max", sweep.settle_max, zero_or_more);
  sweep.integrate = read_span(section, "integrate", sweep.integrate, zero_or_more);
  sweep.integrate_max = read_span(section, "integrate_max", sweep.integrate_max, zero_or_more);
  sweep.block = read_span(section, "block", sweep.block, {.min = 1.0});
  sweep.target_db = section.number("target_db", {.min = 0.0, .max = 20.0}, sweep.target_db);
  sweep.target_deg = section.number("target_deg", {.min = 0.0, .max = 90.0}, sweep.target_deg);
  sweep.target_of_first = section.choice("target_for", {"all", "first"}) == "first";
  sweep.harmonics = static_cast<std::uint32_t>(
      section.integer("harmonics", {.min = 1.0, .max = 16.0}, sweep.harmonics));
  sweep.max_distortion = section.number("max_distortion", above_zero, sweep.max_distortion);
  return sweep;
}

}  // namespace sinerig::config
