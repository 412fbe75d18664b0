#include "cli/plant_model.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <optional>

#include <nlohmann/json.hpp>
#include <spdlog/spdlog.h>

#include "cli/fit_command.h"
#include "record/database.h"
#include "record/fit_store.h"
#include "report/fit_report.h"

namespace sinerig::cli {

namespace {

using Json = nlohmann::json;
using identify::LogScatter;

std::complex<double> complex_of(const Json& pair) {
  return {pair.at(0).get<double>(), pair.at(1).get<double>()};
}

// A figure that is not finite is stored as null.
double number_or_nan(const Json& value) {
  return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

identify::Estimate estimate_of(const Json& json) {
  return {number_or_nan(json.at("value")), number_or_nan(json.at("standard_error"))};
}

void read_json(const Json& json, PlantModel& model) {
  for (const Json& pole : json.at("poles")) model.zpk.poles.push_back(complex_of(pole));
  for (const Json& zero : json.at("zeros")) model.zpk.zeros.push_back(complex_of(zero));
  model.zpk.gain = json.at("gain").get<double>();
  model.zpk.delay_s = json.at("delay_s").get<double>();
  for (const Json& mode : json.at("modes")) {
    identify::Mode each{};
    each.frequency_hz = estimate_of(mode.at("frequency_hz"));
    each.damping = estimate_of(mode.at("damping"));
    each.pole = complex_of(mode.at("pole"));
    model.modes.push_back(each);
  }
  const Json& stored = json.at("root_covariance");
  model.root_covariance.reference_rad_s =
      2.0 * std::numbers::pi * stored.at("reference_hz").get<double>();
  const Json& rows = stored.at("matrix");
  const auto size = static_cast<Eigen::Index>(rows.size());
  model.root_covariance.covariance.resize(size, size);
  for (Eigen::Index i = 0; i < size; ++i)
    for (Eigen::Index k = 0; k < size; ++k)
      model.root_covariance.covariance(i, k) =
          number_or_nan(rows.at(static_cast<std::size_t>(i)).at(static_cast<std::size_t>(k)));
  if (size != identify::coordinates_of(model.zpk))
    throw record::SweepFileError("the covariance does not belong to the roots");
}

std::string fitted(const std::string& file, const std::string& channel, const std::string& hold,
                   bool trust_units, bool store) {
  FitCommandOptions options;
  options.files = {file};
  options.channel = channel;
  options.hold = hold;
  options.trust_units = trust_units;
  options.stable_in_open_loop = true;
  options.no_store = !store;
  const report::FitReport report = fit_files(options);
  if (!report.fit.converged) spdlog::warn("the fit has not converged: {}", report.fit.reason);
  return report::fit_json(report);
}

std::string hold_text(double rate_hz) {
  if (!(rate_hz > 0.0)) return "none";
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", rate_hz);
  return text;
}

// A model that still has the hold in it gets it twice where a loop puts its own in front.
bool same_hold(const std::string& fit, double rate_hz) {
  const Json json = Json::parse(fit, nullptr, false);
  if (!json.is_object() || !json.contains("hold_period_s")) return true;
  const double held = number_or_nan(json["hold_period_s"]) * rate_hz;
  return rate_hz > 0.0 ? std::abs(held - 1.0) < 1e-9 : number_or_nan(json["hold_period_s"]) == 0.0;
}

// A run that was interrupted and fitted, then resumed, has points that its fit knows nothing of. A
// joint fit has those of other files, too.
bool knows_points(const std::string& fit, const identify::Response& points) {
  constexpr double same = 1e-6;  // part of a frequency
  const Json json = Json::parse(fit, nullptr, false);
  if (!json.is_object() || !json.contains("response") || !json["response"].is_array()) return true;
  std::vector<double> fitted_hz;
  for (const Json& point : json["response"])
    if (point.is_object() && point.contains("freq_hz"))
      fitted_hz.push_back(number_or_nan(point["freq_hz"]));
  std::sort(fitted_hz.begin(), fitted_hz.end());
  return std::all_of(points.begin(), points.end(), [&](const identify::ResponsePoint& point) {
    const double hz = point.omega_rad_s / (2.0 * std::numbers::pi);
    const auto next = std::lower_bound(fitted_hz.begin(), fitted_hz.end(), hz * (1.0 - same));
    return next != fitted_hz.end() && *next <= hz * (1.0 + same);
  });
}

void warn_of_stored(const std::string& file, const Json& json, const PlantModel& model) {
  if (json.contains("converged") && json["converged"] == false)
    spdlog::warn("the stored fit of {} has not converged; --refit makes another", file);
  const bool grows = std::any_of(model.zpk.poles.begin(), model.zpk.poles.end(),
                                 [](std::complex<double> pole) { return pole.real() > 0.0; });
  if (grows && model.measured.driven_by_command)
    spdlog::warn(
        "the stored fit of {} is unstable, but what was swept in open loop without running away is "
        "not: what follows misleads; --refit keeps the poles in the left half plane",
        file);
}

}  // namespace

PlantModel read_plant_model(const std::string& file, const std::string& channel, bool refit,
                            std::optional<double> hold_hz, bool trust_units) {
  PlantModel model;
  model.measured = read_fit_input(file, channel, trust_units);
  if (hold_hz) take_hold(model.measured, *hold_hz);
  std::optional<std::string> json;
  if (model.measured.sweep_file && !refit)
    json = record::last_fit(file, model.measured.input, model.measured.output);
  bool store = !hold_hz;
  if (json && !knows_points(*json, model.measured.response)) {
    spdlog::info("{} has points that its stored fit was made without; fitting it again", file);
    json.reset();
    refit = true;
  }
  if (json && !same_hold(*json, model.measured.hold_hz)) {
    spdlog::info(
        "the stored fit of {} was made with another hold than that of its loop; fitting it again "
        "for this loop, --refit stores the new fit",
        file);
    json.reset();
    store = false;
  } else if (!json && !refit) {
    spdlog::info("{} holds no fit; fitting it first, order chosen by itself", file);
  }
  const bool stored = json.has_value();
  if (!json) json = fitted(file, channel, hold_text(model.measured.hold_hz), trust_units, store);
  const Json parsed = Json::parse(*json, nullptr, false);
  try {
    read_json(parsed, model);
  } catch (const std::exception&) {
    throw record::SweepFileError(
        file + ": its stored fit lacks what is needed; make a new one with --refit");
  }
  if (stored) warn_of_stored(file, parsed, model);
  return model;
}

identify::Curve::Scatter PlantModel::scatter() const {
  return [zpk = zpk, covariance = root_covariance](double omega_rad_s) {
    return identify::log_scatter(identify::response_with_covariance(zpk, covariance, omega_rad_s));
  };
}

}  // namespace sinerig::cli
