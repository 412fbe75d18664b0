#include "report/notch_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <ostream>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "report/loop_report.h"

namespace sinerig::report {

namespace {

using Json = nlohmann::ordered_json;

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  char text[200];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

std::string format_name(const identify::FixedBiquad& fixed) {
  return format("Q%d.%d", fixed.bits - fixed.fraction_bits, fixed.fraction_bits);
}

// Gain of the filter as rounded, at the centre of the notch, dB.
double fixed_depth_db(const DesignedNotch& each) {
  const identify::Notch& notch = each.design.notch;
  const double angle = 2.0 * std::numbers::pi * notch.frequency_hz / notch.rate_hz;
  return 20.0 * std::log10(std::abs(each.fixed->value().at(angle)));
}

template <typename Numbers>
std::string row(const Numbers& numbers, const char* pattern) {
  std::string text;
  for (const auto number : numbers) {
    if (!text.empty()) text += ", ";
    text += format(pattern, number);
  }
  return text;
}

std::array<long long, 5> integers_of(const identify::FixedBiquad& fixed) {
  std::array<long long, 5> out{};
  std::copy(fixed.integers.begin(), fixed.integers.end(), out.begin());
  return out;
}

// An interval wider than its value is cut off just above zero.
std::string damping_text(const identify::UncertainMode& mode) {
  if (mode.damping_low < 1e-3 * mode.damping_high)
    return format("damping not known, %.4g at most", mode.damping_high);
  return format("damping %.4g to %.4g", mode.damping_low, mode.damping_high);
}

void print_one(std::ostream& stream, const DesignedNotch& each) {
  const identify::NotchDesign& design = each.design;
  const identify::Notch& notch = design.notch;
  stream << format("notch at %.6g Hz, depth %.4g dB, width %.4g Hz (damping %.5g over %.5g)\n",
                   notch.frequency_hz, notch.depth_db(), notch.width_hz(), notch.zero_damping,
                   notch.pole_damping)
         << format("  resonance      %.6g to %.6g Hz, ", each.mode.low_hz, each.mode.high_hz)
         << damping_text(each.mode) << '\n'
         << format("  attenuation    %.4g dB at least over that interval, %.4g dB wanted\n",
                   design.worst_attenuation_db, each.request.attenuation_db)
         << format("  phase cost     %.4g deg at %.5g Hz\n", design.phase_cost_deg,
                   each.request.crossover_hz);
  if (each.biquad)
    stream << "  b0 b1 b2 a1 a2 " << row(each.biquad->coefficients(), "%.17g") << '\n'
           << "  " << format_name(*each.fixed) << "          "
           << row(integers_of(*each.fixed), "%lld")
           << format("  (%.4g dB at the centre)\n", fixed_depth_db(each));
  stream << '\n';
}

Json notch_object(const DesignedNotch& each) {
  const identify::Notch& notch = each.design.notch;
  Json json{{"frequency_hz", notch.frequency_hz},
            {"zero_damping", notch.zero_damping},
            {"pole_damping", notch.pole_damping},
            {"depth_db", notch.depth_db()},
            {"width_hz", notch.width_hz()},
            {"interval_hz", Json::array({each.mode.low_hz, each.mode.high_hz})},
            {"attenuation_db", each.request.attenuation_db},
            {"worst_attenuation_db", each.design.worst_attenuation_db},
            {"crossover_hz", each.request.crossover_hz},
            {"phase_cost_deg", each.design.phase_cost_deg},
            {"biquad", nullptr},
            {"fixed", nullptr}};
  if (!each.biquad) return json;
  const identify::Biquad& c = *each.biquad;
  json["biquad"] = {{"b", Json::array({c.b0, c.b1, c.b2})}, {"a", Json::array({1.0, c.a1, c.a2})}};
  const auto& k = each.fixed->integers;
  json["fixed"] = {{"format", format_name(*each.fixed)},
                   {"fraction_bits", each.fixed->fraction_bits},
                   {"b", Json::array({k[0], k[1], k[2]})},
                   {"a", Json::array({std::int64_t{1} << each.fixed->fraction_bits, k[3], k[4]})},
                   {"depth_db", fixed_depth_db(each)}};
  return json;
}

}  // namespace

void print_notch(std::ostream& stream, const NotchReport& report) {
  stream << report.label << ", " << report.controller;
  if (report.rate_hz > 0.0) stream << format(" at %.6g Hz", report.rate_hz);
  stream << "\n\n";
  for (const DesignedNotch& each : report.notches) print_one(stream, each);
  if (report.before) print_loop(stream, "before", report.before->figures, report.before->stable);
  if (report.after) {
    stream << '\n';
    print_loop(stream, "after", report.after->figures, report.after->stable);
  }
}

void print_notch_c(std::ostream& stream, const NotchReport& report) {
  if (!(report.rate_hz > 0.0))
    throw std::invalid_argument("notch: coefficients need a rate; give --rate");
  const identify::FixedBiquad& first = *report.notches.front().fixed;
  const std::size_t count = report.notches.size();
  stream << format("/* %s at %.9g Hz: rows b0 b1 b2 a1 a2, a0 = 1;\n", "notches", report.rate_hz)
         << "   y[n] = b0 x[n] + b1 x[n-1] + b2 x[n-2] - a1 y[n-1] - a2 y[n-2] */\n"
         << format("static const double notch[%zu][5] = {\n", count);
  for (const DesignedNotch& each : report.notches)
    stream << "    {" << row(each.biquad->coefficients(), "%.17g")
           << format("}, /* %.6g Hz */\n", each.design.notch.frequency_hz);
  stream << "};\n/* the same in " << format_name(first) << " */\n"
         << format("static const int%d_t notch_fixed[%zu][5] = {\n", first.bits <= 32 ? 32 : 64,
                   count);
  for (const DesignedNotch& each : report.notches)
    stream << "    {" << row(integers_of(*each.fixed), "%lld")
           << format("}, /* %.6g Hz */\n", each.design.notch.frequency_hz);
  stream << "};\n";
}

std::string notch_json(const NotchReport& report) {
  Json json{{"label", report.label},     {"controller", report.controller},
            {"rate_hz", report.rate_hz}, {"notches", Json::array()},
            {"before", nullptr},         {"after", nullptr}};
  for (const DesignedNotch& each : report.notches) json["notches"].push_back(notch_object(each));
  if (report.before) json["before"] = loop_json(report.before->figures, report.before->stable);
  if (report.after) json["after"] = loop_json(report.after->figures, report.after->stable);
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace sinerig::report
