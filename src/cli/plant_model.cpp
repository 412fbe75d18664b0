#include "cli/plant_model.h"

#include <numbers>
#include <optional>

#include <nlohmann/json.hpp>
#include <spdlog/spdlog.h>

#include "cli/fit_command.h"
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
double number_or_zero(const Json& value) {
  return value.is_number() ? value.get<double>() : 0.0;
}

identify::Estimate estimate_of(const Json& json) {
  return {number_or_zero(json.at("value")), number_or_zero(json.at("standard_error"))};
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
          number_or_zero(rows.at(static_cast<std::size_t>(i)).at(static_cast<std::size_t>(k)));
  if (size != identify::coordinates_of(model.zpk))
    throw InputError("the covariance does not belong to the roots");
}

std::string fitted(const std::string& file, const std::string& channel) {
  FitCommandOptions options;
  options.files = {file};
  options.channel = channel;
  const report::FitReport report = fit_files(options);
  if (!report.fit.converged) spdlog::warn("the fit has not converged: {}", report.fit.reason);
  return report::fit_json(report);
}

}  // namespace

PlantModel read_plant_model(const std::string& file, const std::string& channel, bool refit) {
  PlantModel model;
  model.measured = read_fit_input(file, channel);
  std::optional<std::string> json;
  if (model.measured.sweep_file && !refit)
    json = record::last_fit(file, model.measured.input, model.measured.output);
  if (!json) {
    if (!refit) spdlog::info("{} holds no fit; fitting it first, order chosen by itself", file);
    json = fitted(file, channel);
  }
  const Json parsed = Json::parse(*json, nullptr, false);
  try {
    read_json(parsed, model);
  } catch (const std::exception&) {
    throw InputError(file + ": its stored fit lacks what is needed; make a new one with --refit");
  }
  return model;
}

identify::Curve::Scatter PlantModel::scatter() const {
  return [zpk = zpk, covariance = root_covariance](double omega_rad_s) {
    return identify::log_scatter(identify::response_with_covariance(zpk, covariance, omega_rad_s));
  };
}

}  // namespace sinerig::cli
