#include "report/fit_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <ostream>

#include <nlohmann/json.hpp>

namespace sinerig::report {

namespace {

using Json = nlohmann::ordered_json;
using identify::Fit;

constexpr double turn = 2.0 * std::numbers::pi;
constexpr std::size_t candidates_shown = 8;

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  char text[160];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

std::string polynomial_text(const std::vector<double>& coefficients) {
  std::string text;
  for (std::size_t i = 0; i < coefficients.size(); ++i) {
    const std::size_t power = coefficients.size() - 1 - i;
    if (!text.empty()) text += coefficients[i] < 0.0 ? " - " : " + ";
    text += format("%.7g", text.empty() ? coefficients[i] : std::abs(coefficients[i]));
    if (power > 0) text += " s";
    if (power > 1) text.append("^").append(std::to_string(power));
  }
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
    stream << format("residual     %.3g rms, relative\n",
                     std::sqrt(fit.chi2 / std::max(fit.degrees_of_freedom, 1)));
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
                     c.parameters, c.chi2, c.criterion, i == 0 ? "  chosen" : "");
  }
}

Json pair_json(std::complex<double> value) {
  return Json::array({value.real(), value.imag()});
}

Json estimate_json(const identify::Estimate& estimate) {
  return {{"value", estimate.value}, {"standard_error", estimate.standard_error}};
}

Json roots_json(const std::vector<identify::RootEstimate>& roots) {
  Json list = Json::array();
  for (const auto& root : roots) list.push_back(pair_json(root.root));
  return list;
}

// Per root: variance of the real part, covariance, variance of the imaginary part.
Json roots_covariance_json(const std::vector<identify::RootEstimate>& roots) {
  Json list = Json::array();
  for (const auto& root : roots)
    list.push_back(Json::array({root.variance_re, root.covariance, root.variance_im}));
  return list;
}

Json modes_json(const Fit& fit) {
  Json list = Json::array();
  for (const identify::Mode& mode : fit.modes)
    list.push_back({{"frequency_hz", estimate_json(mode.frequency_hz)},
                    {"damping", estimate_json(mode.damping)},
                    {"pole", pair_json(mode.pole)},
                    {"residue", pair_json(mode.residue)},
                    {"residue_standard_error", mode.residue_standard_error}});
  return list;
}

void add_fit(Json& json, const FitReport& report) {
  const Fit& fit = *report.fit;
  json["num_standard_error"] = fit.num_standard_error;
  json["den_standard_error"] = fit.den_standard_error;
  json["delay_standard_error"] = fit.delay_s.standard_error;
  json["static_gain"] = estimate_json(fit.static_gain);
  json["gain"] = fit.zpk.gain;
  json["poles"] = roots_json(fit.poles);
  json["zeros"] = roots_json(fit.zeros);
  json["poles_covariance"] = roots_covariance_json(fit.poles);
  json["zeros_covariance"] = roots_covariance_json(fit.zeros);
  json["modes"] = modes_json(fit);
  json["chi2_interval"] = Json::array({fit.chi2_low, fit.chi2_high});
  json["degrees_of_freedom"] = fit.degrees_of_freedom;
  json["parameters"] = fit.free_parameters;
  json["scatter_known"] = fit.scatter_known;
  json["condition"] = fit.condition;
  json["iterations"] = fit.iterations;
  json["reason"] = fit.reason;
  Json outliers = Json::array();
  for (const std::size_t i : fit.outliers)
    outliers.push_back(report.response[i].omega_rad_s / turn);
  json["outliers_hz"] = outliers;
  Json covariance = Json::array();
  for (Eigen::Index row = 0; row < fit.covariance.rows(); ++row) {
    const Eigen::RowVectorXd values = fit.covariance.row(row);
    covariance.push_back(std::vector<double>(values.begin(), values.end()));
  }
  json["covariance"] = covariance;
  Json band = Json::array();
  for (const identify::ResponsePoint& point : report.response) {
    const identify::ResponsePoint model = fit.response(point.omega_rad_s);
    band.push_back({{"freq_hz", point.omega_rad_s / turn},
                    {"re", model.response.real()},
                    {"im", model.response.imag()},
                    {"var_re", model.variance_re},
                    {"cov_re_im", model.covariance},
                    {"var_im", model.variance_im}});
  }
  json["response"] = band;
}

void add_choe(Json& json, const FitReport& report) {
  Json models = Json::array();
  for (const auto& model : report.choe->band_models)
    models.push_back({{"num", model.num}, {"den", model.den}});
  json["band_models"] = models;
  Json nominal = Json::array();
  for (const auto value : report.choe->nominal) nominal.push_back(pair_json(value));
  json["nominal"] = nominal;
  json["weight"] = report.choe->weight;
}

}  // namespace

void print_fit(std::ostream& stream, const FitReport& report) {
  stream << report.label << ", " << report.response.size() << " points, method " << report.method
         << "\n\n  " << polynomial_text(report.model.num) << "\n  over\n  "
         << polynomial_text(report.model.den) << "\n\n";
  if (report.fit) {
    print_quality(stream, *report.fit);
    for (const std::size_t i : report.fit->outliers)
      stream << format("outlier left out: %.6g Hz\n", report.response[i].omega_rad_s / turn);
  } else {
    stream << format("delay        %.6g s, as given\n", report.model.delay_s);
  }
  print_candidates(stream, report);
}

std::string fit_json(const FitReport& report) {
  Json json{{"label", report.label},
            {"method", report.method},
            {"num", report.model.num},
            {"den", report.model.den},
            {"delay_s", report.model.delay_s},
            {"chi2", nullptr},
            {"converged", true},
            {"hold_period_s", report.hold_period_s},
            {"path_delay_s", report.path_delay_s}};
  if (report.fit) {
    json["chi2"] = report.fit->chi2;
    json["converged"] = report.fit->converged;
    add_fit(json, report);
  }
  if (report.choe) add_choe(json, report);
  Json candidates = Json::array();
  for (const identify::OrderCandidate& c : report.table)
    candidates.push_back({{"poles", c.poles},
                          {"zeros", c.zeros},
                          {"origin", c.origin},
                          {"parameters", c.parameters},
                          {"chi2", c.chi2},
                          {"criterion", c.criterion},
                          {"explained", c.explained}});
  json["candidates"] = candidates;
  return json.dump(2);
}

}  // namespace sinerig::report
