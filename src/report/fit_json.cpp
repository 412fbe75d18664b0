#include <cmath>
#include <numbers>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "identify/modal_form.h"
#include "identify/sections.h"
#include "report/fit_report.h"

namespace sinerig::report {

namespace {

using Json = nlohmann::ordered_json;
using identify::Fit;
using identify::ZerosPolesGain;
using Values = std::vector<double>;

constexpr double turn = 2.0 * std::numbers::pi;

Json pair_json(std::complex<double> value) {
  return Json::array({value.real(), value.imag()});
}

Json estimate_json(const identify::Estimate& estimate) {
  return {{"value", estimate.value}, {"standard_error", estimate.standard_error}};
}

Json rows_json(const Eigen::MatrixXd& matrix) {
  Json rows = Json::array();
  for (const auto& row : matrix.rowwise()) rows.push_back(Values(row.begin(), row.end()));
  return rows;
}

Json roots_json(const std::vector<std::complex<double>>& roots) {
  Json list = Json::array();
  for (const auto root : roots) list.push_back(pair_json(root));
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

Json sections_json(const Fit& fit) {
  const auto numbers = [](const ZerosPolesGain& model) {
    Values all;
    for (const identify::Section& section : identify::second_order_sections(model)) {
      all.insert(all.end(), section.num.begin(), section.num.end());
      all.insert(all.end(), section.den.begin(), section.den.end());
    }
    return all;
  };
  const Values values = numbers(fit.zpk);
  const Values errors = identify::standard_errors(fit.zpk, fit.root_covariance, numbers);
  Json list = Json::array();
  for (auto i = values.begin(), e = errors.begin(); i != values.end(); i += 6, e += 6)
    list.push_back({{"num", Values(i, i + 3)},
                    {"den", Values(i + 3, i + 6)},
                    {"num_standard_error", Values(e, e + 3)},
                    {"den_standard_error", Values(e + 3, e + 6)}});
  return list;
}

// A by rows, then B, C and D.
Values numbers_of(const identify::StateSpace& system) {
  Values all;
  for (const auto& row : system.A.rowwise()) all.insert(all.end(), row.begin(), row.end());
  all.insert(all.end(), system.B.begin(), system.B.end());
  all.insert(all.end(), system.C.begin(), system.C.end());
  all.push_back(system.D);
  return all;
}

Json system_json(const Values& numbers, std::size_t order) {
  const auto at = [&](std::size_t first, std::size_t count) {
    const auto begin = numbers.begin() + static_cast<std::ptrdiff_t>(first);
    return Values(begin, begin + static_cast<std::ptrdiff_t>(count));
  };
  Json A = Json::array();
  for (std::size_t row = 0; row < order; ++row) A.push_back(at(row * order, order));
  return {{"A", A},
          {"B", at(order * order, order)},
          {"C", at(order * order + order, order)},
          {"D", numbers.back()}};
}

Json state_space_json(const Fit& fit) {
  const auto numbers = [](const ZerosPolesGain& model) {
    return numbers_of(identify::to_modal_form(model));
  };
  const std::size_t order = static_cast<std::size_t>(identify::to_modal_form(fit.zpk).A.rows());
  Json json = system_json(numbers(fit.zpk), order);
  json["delay_s"] = fit.zpk.delay_s;
  json["standard_error"] =
      system_json(identify::standard_errors(fit.zpk, fit.root_covariance, numbers), order);
  return json;
}

Json discrete_json(const FitReport& report) {
  const Fit& fit = report.fit;
  const identify::DiscreteModel model = discrete_equivalent(*report.discrete, fit.zpk);
  const auto numbers = [&](const ZerosPolesGain& moved) {
    const identify::DiscreteModel other = discrete_equivalent(*report.discrete, moved);
    Values all = other.num();
    const Values den = other.den();
    all.insert(all.end(), den.begin(), den.end());
    return all;
  };
  const Values num = model.num();
  const Values errors = identify::standard_errors(fit.zpk, fit.root_covariance, numbers);
  const auto split = errors.begin() + static_cast<std::ptrdiff_t>(num.size());
  return {{"method", report.discrete->method},
          {"rate_hz", 1.0 / model.period_s},
          {"prewarp_hz", report.discrete->prewarp_rad_s / turn},
          {"num", num},
          {"den", model.den()},
          {"num_standard_error", Values(errors.begin(), split)},
          {"den_standard_error", Values(split, errors.end())},
          {"delay_ticks", model.delay_ticks},
          {"gain", model.gain},
          {"zeros", roots_json(model.zeros)},
          {"poles", roots_json(model.poles)}};
}

Json band_json(const FitReport& report) {
  Json band = Json::array();
  for (const identify::ResponsePoint& point : report.response) {
    const identify::ResponsePoint model = report.fit.response(point.omega_rad_s);
    band.push_back({{"freq_hz", point.omega_rad_s / turn},
                    {"re", model.response.real()},
                    {"im", model.response.imag()},
                    {"var_re", model.variance_re},
                    {"cov_re_im", model.covariance},
                    {"var_im", model.variance_im}});
  }
  return band;
}

// |G_k − G_nom| and |W_a| on the grid of the points; the models are those of the sub-bands.
Json choe_json(const identify::ChoeFit& choe) {
  Json frequencies = Json::array();
  Json bands = Json::array();
  for (const identify::Response& band : choe.bands) {
    for (const auto& point : band) frequencies.push_back(point.omega_rad_s / turn);
    bands.push_back({{"low_hz", band.front().omega_rad_s / turn},
                     {"high_hz", band.back().omega_rad_s / turn},
                     {"points", band.size()}});
  }
  Json models = Json::array();
  for (const auto& model : choe.band_models)
    models.push_back({{"num", model.num}, {"den", model.den}});
  Json nominal = Json::array();
  for (const auto value : choe.nominal) nominal.push_back(pair_json(value));
  return {{"freq_hz", frequencies},    {"bands", bands},
          {"band_models", models},     {"nominal", nominal},
          {"additive", choe.additive}, {"weight", choe.weight}};
}

void add_forms(Json& json, const FitReport& report) {
  const Fit& fit = report.fit;
  // A model with more zeros than poles has none of these.
  const bool proper = fit.zpk.zeros.size() <= fit.zpk.poles.size();
  json["sections"] = proper ? sections_json(fit) : Json();
  json["state_space"] = proper ? state_space_json(fit) : Json();
  if (report.discrete) json["discrete"] = discrete_json(report);
}

void add_quality(Json& json, const FitReport& report) {
  const Fit& fit = report.fit;
  json["chi2_interval"] = Json::array({fit.chi2_low, fit.chi2_high});
  json["degrees_of_freedom"] = fit.degrees_of_freedom;
  json["parameters"] = fit.free_parameters;
  json["scatter_known"] = fit.scatter_known;
  json["model_error"] = fit.model_error;
  json["condition"] = fit.condition;
  json["iterations"] = fit.iterations;
  json["reason"] = fit.reason;
  Json outliers = Json::array();
  for (const std::size_t i : fit.outliers)
    outliers.push_back(report.response[i].omega_rad_s / turn);
  json["outliers_hz"] = outliers;
}

Json candidates_json(const FitReport& report) {
  Json candidates = Json::array();
  for (const identify::OrderCandidate& c : report.table)
    candidates.push_back({{"poles", c.poles},
                          {"zeros", c.zeros},
                          {"origin", c.origin},
                          {"parameters", c.parameters},
                          {"chi2", c.chi2},
                          {"criterion", c.criterion},
                          {"explained", c.explained},
                          {"at_limit", c.at_limit}});
  return candidates;
}

}  // namespace

std::string fit_json(const FitReport& report) {
  const Fit& fit = report.fit;
  Json json{{"label", report.label},
            {"method", report.method},
            {"num", fit.model.num},
            {"den", fit.model.den},
            {"delay_s", fit.model.delay_s},
            {"chi2", fit.chi2},
            {"converged", fit.converged},
            {"num_standard_error", fit.num_standard_error},
            {"den_standard_error", fit.den_standard_error},
            {"delay_standard_error", fit.delay_s.standard_error},
            {"hold_period_s", report.hold_period_s},
            {"path_delay_s", report.path_delay_s},
            {"static_gain", estimate_json(fit.static_gain)},
            {"gain", fit.zpk.gain},
            {"poles", roots_json(fit.zpk.poles)},
            {"zeros", roots_json(fit.zpk.zeros)},
            {"poles_covariance", roots_covariance_json(fit.poles)},
            {"zeros_covariance", roots_covariance_json(fit.zeros)},
            {"modes", modes_json(fit)}};
  add_quality(json, report);
  add_forms(json, report);
  json["covariance"] = rows_json(fit.covariance);
  json["root_covariance"] = {{"reference_hz", fit.root_covariance.reference_rad_s / turn},
                             {"matrix", rows_json(fit.root_covariance.covariance)}};
  json["response"] = band_json(report);
  if (report.choe) json["choe"] = choe_json(*report.choe);
  json["candidates"] = candidates_json(report);
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace sinerig::report
