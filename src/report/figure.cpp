#include "report/figure.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <ostream>

#include "record/confidence.h"
#include "report/model_curve.h"
#include "report/run_summary.h"
#include "report/svg_panel.h"
#include "report/xml.h"

namespace sinerig::report {

namespace {

using record::StoredPoint;
using record::StoredResponse;

constexpr double width = 960.0;
constexpr double height = 860.0;
constexpr double left = 78.0;
constexpr double right = width - 24.0;
// Of an axis, dB and degrees: far above rounding and a hundredth of what any bench resolves.
constexpr double least_span = 1e-3;
using record::degrees_per_radian;

double db(double value) {
  return 20.0 * std::log10(value);
}

Axis frequency_axis(const StoredResponse& response) {
  double low = 1.0;
  double high = 10.0;
  if (!response.points.empty()) {
    low = response.points.front().frequency_hz;
    high = response.points.back().frequency_hz;
  }
  if (high < 1.001 * low) {
    low *= 0.5;
    high *= 2.0;
  }
  const double margin = std::pow(high / low, 0.015);
  return {
      .low = low / margin, .high = high * margin, .from = left, .to = right, .logarithmic = true};
}

// The three quantities of the sheet, per point.
struct Curves {
  std::vector<double> frequency_hz, gain_db, gain_low, gain_high, phase_deg, phase_low, phase_high;
  std::vector<double> gain95_db, phase95_deg;
  std::vector<std::string> status;
};

Curves curves_of(const StoredResponse& response) {
  Curves curves;
  const std::vector<double> phase = record::unwrapped_phase(response.points);
  for (std::size_t i = 0; i < response.points.size(); ++i) {
    const StoredPoint& point = response.points[i];
    const record::HalfWidth95 half = half_width95(point);
    const double gain = std::abs(point.response);
    const double phase_deg = phase[i] * degrees_per_radian;
    const double phase95_deg = half.phase_rad * degrees_per_radian;
    curves.frequency_hz.push_back(point.frequency_hz);
    curves.gain_db.push_back(db(gain));
    curves.gain_low.push_back(db(gain * std::max(1.0 - half.gain, 1e-9)));
    curves.gain_high.push_back(db(gain * (1.0 + half.gain)));
    curves.phase_deg.push_back(phase_deg);
    curves.phase_low.push_back(phase_deg - phase95_deg);
    curves.phase_high.push_back(phase_deg + phase95_deg);
    curves.gain95_db.push_back(half.gain * record::db_per_relative);
    curves.phase95_deg.push_back(phase95_deg);
    curves.status.push_back(point.status);
  }
  return curves;
}

void draw_model(SvgPanel& gain, SvgPanel& phase, const Curves& curves,
                const record::StoredFit& fit) {
  const std::vector<double> grid =
      curve_grid(fit, curves.frequency_hz.front(), curves.frequency_hz.back());
  const std::vector<std::complex<double>> response = model_response(fit, grid);
  std::vector<StoredPoint> points(grid.size());
  std::vector<double> gains;
  for (std::size_t i = 0; i < grid.size(); ++i) {
    points[i].response = response[i];
    gains.push_back(db(std::abs(response[i])));
  }
  std::vector<double> phases = record::unwrapped_phase(points);
  const double first = curves.phase_deg.front() / degrees_per_radian;
  const double turn = 2.0 * std::numbers::pi;
  const double shift = std::isfinite(first) ? turn * std::round((first - phases[0]) / turn) : 0.0;
  for (double& each : phases) each = (each + shift) * degrees_per_radian;
  gain.line(grid, gains, {.stroke = "#1b1f24", .width = 1.5});
  phase.line(grid, phases, {.stroke = "#1b1f24", .width = 1.5});
}

}  // namespace

void write_bode_svg(std::ostream& stream, const LabelledRun& labelled,
                    const StoredResponse& response) {
  const record::StoredRun& run = labelled.run;
  const Curves curves = curves_of(response);
  const record::StoredFit* fit = latest_fit(run, response);
  const Axis x = frequency_axis(response);
  const SvgStyle series{.stroke = "#1f66c1", .width = fit == nullptr ? 1.3 : 0.6};

  const std::string measured_in = response_unit(run, response);
  const std::string unit = measured_in == "1" ? "1" : "1 " + measured_in;

  stream << "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " << width << ' ' << height
         << "\" width=\"" << width << "\" height=\"" << height
         << "\" font-family=\"system-ui, 'Noto Sans', 'DejaVu Sans', sans-serif\" font-size=\"13\">"
         << "<rect width=\"" << width << "\" height=\"" << height << "\" fill=\"#ffffff\"/>"
         << "<text x=\"24\" y=\"36\" font-size=\"20\" font-weight=\"600\" fill=\"#1b1f24\">"
         << xml_text(labelled.label + ": " + response_name(run, response)) << "</text>"
         << "<text x=\"24\" y=\"57\" fill=\"#5b636c\">" << xml_text(about_run(run)) << "</text>";

  SvgPanel gain{stream, x, {.top = 92, .bottom = 392}, "Gain, dB re " + unit};
  gain.range(curves.gain_db, {.logarithmic = false, .angle = false, .least_span = least_span});
  gain.band(curves.frequency_hz, curves.gain_low, curves.gain_high, series);
  gain.line(curves.frequency_hz, curves.gain_db, series);
  gain.marks(curves.frequency_hz, curves.gain_db, curves.status, series);

  SvgPanel phase{stream, x, {.top = 440, .bottom = 660}, "Phase, degrees"};
  phase.range(curves.phase_deg, {.logarithmic = false, .angle = true, .least_span = least_span});
  phase.band(curves.frequency_hz, curves.phase_low, curves.phase_high, series);
  phase.line(curves.frequency_hz, curves.phase_deg, series);
  phase.marks(curves.frequency_hz, curves.phase_deg, curves.status, series);
  if (fit != nullptr && !curves.frequency_hz.empty()) draw_model(gain, phase, curves, *fit);

  SvgPanel width95{stream,
                   x,
                   {.top = 708, .bottom = 828},
                   "Half-width of the 95 % interval: gain in dB (blue), phase in degrees (orange)"};
  std::vector<double> both = curves.gain95_db;
  both.insert(both.end(), curves.phase95_deg.begin(), curves.phase95_deg.end());
  width95.range(both, {.logarithmic = true, .angle = false, .least_span = 0.0});
  width95.line(curves.frequency_hz, curves.gain95_db, {.stroke = "#1f66c1", .width = 1.3});
  width95.line(curves.frequency_hz, curves.phase95_deg, {.stroke = "#c8500f", .width = 1.3});
  stream << "</svg>\n";
}

}  // namespace sinerig::report
