#include "cli/plant_model.h"

#include <algorithm>
#include <cmath>
#include <memory>
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
  for (const Json& point : json.at("response"))
    model.band.push_back({2.0 * std::numbers::pi * point.at("freq_hz").get<double>(),
                          {point.at("re").get<double>(), point.at("im").get<double>()},
                          number_or_zero(point.at("var_re")),
                          number_or_zero(point.at("cov_re_im")),
                          number_or_zero(point.at("var_im"))});
}

std::string fitted(const std::string& file, const std::string& channel) {
  FitCommandOptions options;
  options.files = {file};
  options.channel = channel;
  const report::FitReport report = fit_files(options);
  if (report.fit && !report.fit->converged)
    spdlog::warn("the fit has not converged: {}", report.fit->reason);
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
  } catch (const Json::exception&) {
    throw InputError(file + ": its stored fit lacks what is needed; make a new one with --refit");
  }
  return model;
}

identify::Curve::Scatter PlantModel::scatter() const {
  struct Band {
    std::vector<double> ln_omega;
    std::vector<LogScatter> scatter;
  };
  const auto known = std::make_shared<Band>();
  for (const identify::ResponsePoint& point : band) {
    known->ln_omega.push_back(std::log(point.omega_rad_s));
    known->scatter.push_back(identify::log_scatter(point));
  }
  return [known](double omega) {
    const std::vector<double>& x = known->ln_omega;
    if (x.empty()) return LogScatter{};
    const double at = std::clamp(std::log(omega), x.front(), x.back());
    const auto right = std::upper_bound(x.begin(), x.end() - 1, at);
    const auto i = static_cast<std::size_t>(std::max(right - x.begin(), std::ptrdiff_t{1}));
    if (i >= x.size()) return known->scatter.back();
    const LogScatter& a = known->scatter[i - 1];
    const LogScatter& b = known->scatter[i];
    const double t = (at - x[i - 1]) / (x[i] - x[i - 1]);
    return LogScatter{std::lerp(a.gain, b.gain, t), std::lerp(a.both, b.both, t),
                      std::lerp(a.phase, b.phase, t)};
  };
}

}  // namespace sinerig::cli
