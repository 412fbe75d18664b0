#include "cli/loop_panel.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "cli/notch_command.h"
#include "cli/plant_model.h"
#include "identify/loop_analysis.h"
#include "report/loop_report.h"

namespace sinerig::cli {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t curve_points = 600;

double rounded(double value) {
  return static_cast<double>(static_cast<float>(value));  // what a plot can show
}

Json values(const identify::LoopModel& loop, const std::vector<double>& frequencies_hz) {
  Json re = Json::array();
  Json im = Json::array();
  for (const double frequency_hz : frequencies_hz) {
    const std::complex<double> value = loop.at(2.0 * std::numbers::pi * frequency_hz);
    re.push_back(rounded(value.real()));
    im.push_back(rounded(value.imag()));
  }
  return {{"re", re}, {"im", im}};
}

// Even on a logarithmic axis, and close together around each resonance.
std::vector<double> grid_of(const PlantModel& plant) {
  constexpr double two_pi = 2.0 * std::numbers::pi;
  const double low = plant.measured.response.front().omega_rad_s / two_pi;
  const double high = plant.measured.response.back().omega_rad_s / two_pi;
  std::vector<double> grid;
  for (std::size_t i = 0; i < curve_points; ++i)
    grid.push_back(low * std::pow(high / low, static_cast<double>(i) / (curve_points - 1)));
  for (const identify::Mode& mode : plant.modes) {
    const double width = std::abs(mode.damping.value) * mode.frequency_hz.value;
    for (int k = -40; k <= 40; ++k) {
      const double frequency_hz = mode.frequency_hz.value + 0.2 * k * width;
      if (frequency_hz > low && frequency_hz < high) grid.push_back(frequency_hz);
    }
  }
  std::sort(grid.begin(), grid.end());
  return grid;
}

}  // namespace

Json loop_panel(const std::string& file, const std::string& channel, const LoopOptions& options) {
  const PlantModel plant = read_plant_model(file, channel, false, options.hold_hz);
  LoopOptions loop = options;
  if (!loop.rate_hz && plant.measured.rate_hz > 0.0) loop.rate_hz = plant.measured.rate_hz;
  const identify::LoopModel model = model_loop(loop, plant);
  const bool stable = model.closed_loop_stable();
  const identify::LoopFigures of_model = identify::analyse_loop(model_curve(loop, plant), stable);
  const identify::LoopFigures of_points =
      identify::analyse_loop(measured_loop(loop, plant.measured));
  const std::vector<double> grid = grid_of(plant);
  Json panel{{"label", plant.measured.label},
             {"controller", controller_text(options)},
             {"rate_hz", model.rate_hz()},
             {"model", report::loop_json(of_model, stable)},
             {"points", report::loop_json(of_points, std::nullopt)},
             {"notch", nullptr},
             {"no_notch", ""},
             {"f", grid},
             {"before", values(model, grid)},
             {"after", nullptr}};
  try {
    NotchOptions request;
    request.files = {file};
    request.channel = channel;
    request.loop = loop;
    const NotchedLoop notched = design_notches(request);
    panel["notch"] = Json::parse(report::notch_json(notched.report));
    panel["after"] = values(notched.after, grid);
  } catch (const std::invalid_argument& refusal) {
    panel["no_notch"] = refusal.what();
  }
  return panel;
}

}  // namespace sinerig::cli
