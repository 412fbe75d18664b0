#include "report/fit_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <ostream>

namespace sinerig::report {

namespace {

using identify::Fit;

constexpr double turn = 2.0 * std::numbers::pi;
constexpr std::size_t candidates_shown = 8;

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  char text[160];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

std::string polynomial_text(const std::vector<double>& coefficients, const std::string& variable) {
  std::string text;
  for (std::size_t i = 0; i < coefficients.size(); ++i) {
    const std::size_t power = coefficients.size() - 1 - i;
    if (!text.empty()) text += coefficients[i] < 0.0 ? " - " : " + ";
    text += format("%.7g", text.empty() ? coefficients[i] : std::abs(coefficients[i]));
    if (power > 0) text += " " + variable;
    if (power > 1) text.append("^").append(std::to_string(power));
  }
  return text;
}

std::string errors_text(const std::vector<double>& errors) {
  std::string text;
  for (const double error : errors) text += (text.empty() ? "" : ", ") + format("%.2g", error);
  return text;
}

void print_quality(std::ostream& stream, const Fit& fit) {
  stream << format("delay        %.6g s +- %.2g\n", fit.delay_s.value, fit.delay_s.standard_error);
  stream << format("static gain  %.6g +- %.2g\n", fit.static_gain.value,
                   fit.static_gain.standard_error);
  if (fit.scatter_known)
    stream << format("chi2         %.5g, noise alone leaves %.0f to %.0f\n", fit.chi2, fit.chi2_low,
                     fit.chi2_high);
  else
    stream << format("residual     %.3g rms, relative; the scatter is not known\n",
                     std::sqrt(fit.chi2 / std::max(fit.degrees_of_freedom, 1)));
  if (fit.model_error > 0.0)
    stream << format("model error  %.2g %% added to the scatter\n", 100.0 * fit.model_error);
  stream << format("condition    %.3g, %d iterations, ", fit.condition, fit.iterations)
         << (fit.converged ? "converged" : "not converged: " + fit.reason) << '\n';
  if (!fit.modes.empty()) stream << "\n        mode Hz       +-        damping       +-\n";
  for (const identify::Mode& mode : fit.modes)
    stream << format("  %13.6g %8.2g  %13.6g %8.2g", mode.frequency_hz.value,
                     mode.frequency_hz.standard_error, mode.damping.value,
                     mode.damping.standard_error)
           << (mode.pole.imag() == 0.0 ? "  real pole\n" : "\n");
}

void print_candidates(std::ostream& stream, const FitReport& report) {
  if (report.table.empty()) return;
  stream << "\n  poles zeros origin parameters       chi2  criterion\n";
  for (std::size_t i = 0; i < std::min(report.table.size(), candidates_shown); ++i) {
    const identify::OrderCandidate& c = report.table[i];
    stream << format("  %5d %5d %6d %10d %10.5g %10.5g%s\n", c.poles, c.zeros, c.origin,
                     c.parameters, c.chi2, c.criterion,
                     i == 0       ? "  chosen"
                     : c.at_limit ? "  held by its limits"
                                  : "");
  }
}

void print_choe(std::ostream& stream, const identify::ChoeFit& choe) {
  stream << '\n';
  for (std::size_t k = 0; k < choe.bands.size(); ++k)
    stream << format("sub-band %zu   %.6g to %.6g Hz, %zu points\n", k + 1,
                     choe.bands[k].front().omega_rad_s / turn,
                     choe.bands[k].back().omega_rad_s / turn, choe.bands[k].size())
           << "  " << polynomial_text(choe.band_models[k].num, "s") << "  over  "
           << polynomial_text(choe.band_models[k].den, "s") << '\n';
  const auto [least, most] = std::minmax_element(choe.weight.begin(), choe.weight.end());
  stream << format("weight |W_a| %.4g to %.4g\n", *least, *most);
}

void print_discrete(std::ostream& stream, const FitReport& report) {
  const identify::DiscreteModel model = discrete_equivalent(*report.discrete, report.fit.zpk);
  stream << format("\n%s at %.10g Hz", report.discrete->method.c_str(), 1.0 / model.period_s);
  if (report.discrete->prewarp_rad_s > 0.0)
    stream << format(", exact at %.6g Hz", report.discrete->prewarp_rad_s / turn);
  stream << format(", %d ticks of delay beside\n  ", model.delay_ticks)
         << polynomial_text(model.num(), "z") << "\n  over\n  " << polynomial_text(model.den(), "z")
         << '\n';
}

}  // namespace

identify::DiscreteModel discrete_equivalent(const DiscreteEquivalent& wanted,
                                            const identify::ZerosPolesGain& model) {
  if (wanted.method == "zoh") return identify::hold_equivalent(model, wanted.period_s);
  if (wanted.method == "matched") return identify::matched(model, wanted.period_s);
  return identify::tustin(model, wanted.period_s, wanted.prewarp_rad_s);
}

void print_fit(std::ostream& stream, const FitReport& report) {
  const identify::TransferFunction& model = report.fit.model;
  stream << report.label << ", " << report.response.size() << " points, method " << report.method
         << "\n\n  " << polynomial_text(model.num, "s") << "\n  over\n  "
         << polynomial_text(model.den, "s") << "\n";
  if (model.delay_s != 0.0) stream << format("  times exp(-%.7g s)\n", model.delay_s);
  stream << "\n+- num       " << errors_text(report.fit.num_standard_error) << "\n+- den       "
         << errors_text(report.fit.den_standard_error) << '\n';
  print_quality(stream, report.fit);
  for (const std::size_t i : report.fit.outliers)
    stream << format("outlier left out: %.6g Hz\n", report.response[i].omega_rad_s / turn);
  if (report.choe) print_choe(stream, *report.choe);
  if (report.discrete) print_discrete(stream, report);
  print_candidates(stream, report);
}

}  // namespace sinerig::report
