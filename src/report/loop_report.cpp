#include "report/loop_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ostream>

namespace sinerig::report {

namespace {

using identify::Between;
using identify::Bounded;
using Json = nlohmann::ordered_json;

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  char text[200];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

// What may be near zero and well known for all that: half-widths up to here say something.
constexpr double telling_db = 20.0;
constexpr double telling_deg = 90.0;

// One wider than its value says nothing, and none of no width at all was ever measured: points
// without scatter have those.
bool interval_known(const Bounded& figure, double telling) {
  const double half = 0.5 * (figure.high - figure.low);
  return std::isfinite(half) && half > 0.0 && half <= std::max(std::abs(figure.value), telling);
}

std::string interval_text(const Bounded& figure, double unit = 1.0, double telling = 0.0) {
  if (!interval_known(figure, telling))
    return format("%10.5g  (interval not known)", figure.value * unit);
  return format("%10.5g  (%.5g to %.5g)", figure.value * unit, figure.low * unit,
                figure.high * unit);
}

std::string between_text(const Between& between) {
  if (!between || between->first == between->second) return "";
  return format(", interpolated between %.5g and %.5g Hz", between->first, between->second);
}

void print_line(std::ostream& stream, const char* name, const Bounded& figure, double at_hz,
                const Between& between, double unit = 1.0, double telling = 0.0) {
  stream << format("  %-22s", name) << interval_text(figure, unit, telling)
         << format("  at %.5g Hz", at_hz) << between_text(between) << '\n';
}

Json bounded_json(const Bounded& figure) {
  return {{"value", figure.value}, {"low", figure.low}, {"high", figure.high}};
}

Json between_json(const Between& between) {
  if (!between) return nullptr;
  return Json::array({between->first, between->second});
}

Json json_of(const identify::GainMargin& each) {
  return {{"frequency_hz", bounded_json(each.frequency_hz)},
          {"margin_db", bounded_json(each.margin_db)},
          {"interpolated_between_hz", between_json(each.between_hz)}};
}

Json json_of(const identify::PhaseMargin& each) {
  return {{"frequency_hz", bounded_json(each.frequency_hz)},
          {"margin_deg", bounded_json(each.margin_deg)},
          {"delay_s", bounded_json(each.delay_s)},
          {"interpolated_between_hz", between_json(each.between_hz)}};
}

Json json_of(const identify::Resonance& each) {
  return {{"frequency_hz", each.frequency_hz},
          {"gain_db", bounded_json(each.gain_db)},
          {"rise_db", each.rise_db},
          {"interpolated_between_hz", between_json(each.between_hz)}};
}

template <typename Figure>
Json json_of(const std::optional<Figure>& figure) {
  return figure ? json_of(*figure) : Json(nullptr);
}

template <typename Figure>
Json list_json(const std::vector<Figure>& figures) {
  Json list = Json::array();
  for (const Figure& figure : figures) list.push_back(json_of(figure));
  return list;
}

}  // namespace

void print_loop(std::ostream& stream, const std::string& title,
                const identify::LoopFigures& figures, std::optional<bool> stable) {
  stream << title;
  if (stable) stream << (*stable ? ": closed loop stable" : ": CLOSED LOOP UNSTABLE");
  stream << '\n';
  const auto gain = [&](const char* name, const std::optional<identify::GainMargin>& figure) {
    if (figure)
      print_line(stream, name, figure->margin_db, figure->frequency_hz.value, figure->between_hz,
                 1.0, telling_db);
    else
      stream << format("  %-22s      none, the phase does not cross 180° up to %.5g Hz\n", name,
                       figures.searched_to_hz);
  };
  gain("gain margin, dB", figures.gain_margin);
  if (figures.gain_reduction) gain("gain reduction, dB", figures.gain_reduction);
  if (figures.phase_margin) {
    const identify::PhaseMargin& phase = *figures.phase_margin;
    const identify::PhaseMargin& delay = *figures.delay_margin;
    print_line(stream, "phase margin, deg", phase.margin_deg, phase.frequency_hz.value,
               phase.between_hz, 1.0, telling_deg);
    print_line(stream, "delay margin, ms", delay.delay_s, delay.frequency_hz.value,
               delay.between_hz, 1e3);
  } else {
    stream << format("  %-22s      none, the gain does not cross 1 up to %.5g Hz\n",
                     "phase margin, deg", figures.searched_to_hz);
  }
  for (const identify::PhaseMargin& each : figures.gain_crossings)
    stream << format("  %-22s", "gain crossover, Hz") << interval_text(each.frequency_hz)
           << format("  phase margin %.4g deg", each.margin_deg.value)
           << between_text(each.between_hz) << '\n';
  const identify::SensitivityPeak& peak = figures.sensitivity_peak;
  print_line(stream, "sensitivity peak Ms", peak.peak, peak.frequency_hz, peak.between_hz);
  if (figures.bandwidth_hz)
    stream << format("  %-22s", "bandwidth of T, Hz") << interval_text(*figures.bandwidth_hz)
           << between_text(figures.bandwidth_between_hz) << '\n';
  for (const identify::Resonance& each : figures.resonances)
    print_line(stream, "resonance, dB", each.gain_db, each.frequency_hz, each.between_hz, 1.0,
               telling_db);
}

Json loop_json(const identify::LoopFigures& figures, std::optional<bool> stable) {
  Json json;
  json["stable"] = stable ? Json(*stable) : Json(nullptr);
  json["gain_margin"] = json_of(figures.gain_margin);
  json["gain_reduction"] = json_of(figures.gain_reduction);
  json["phase_margin"] = json_of(figures.phase_margin);
  json["delay_margin"] = json_of(figures.delay_margin);
  json["sensitivity_peak"] = {
      {"frequency_hz", figures.sensitivity_peak.frequency_hz},
      {"peak", bounded_json(figures.sensitivity_peak.peak)},
      {"interpolated_between_hz", between_json(figures.sensitivity_peak.between_hz)}};
  json["bandwidth_hz"] = figures.bandwidth_hz ? bounded_json(*figures.bandwidth_hz) : Json(nullptr);
  json["phase_crossings"] = list_json(figures.phase_crossings);
  json["gain_crossings"] = list_json(figures.gain_crossings);
  json["resonances"] = list_json(figures.resonances);
  return json;
}

}  // namespace sinerig::report
