#include "identify/loop_analysis.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

namespace sinerig::identify {

namespace {

using Complex = std::complex<double>;

constexpr double pi = std::numbers::pi;
constexpr double turn = 2.0 * pi;
constexpr double degree = pi / 180.0;
constexpr double z95 = 1.959964;
const double db_per_neper = 20.0 / std::log(10.0);
constexpr double least_rise_db = 3.0;

Bounded bounded(double value, double variance) {
  const double half = z95 * std::sqrt(std::max(variance, 0.0));
  return {value, value - half, value + half};
}

// For ratios and frequencies, which scatter on a logarithmic scale.
Bounded bounded_ratio(double value, double relative_variance) {
  const double half = z95 * std::sqrt(std::max(relative_variance, 0.0));
  return {value, value * std::exp(-half), value * std::exp(half)};
}

Between between_hz(const Curve& curve, double omega) {
  auto between = curve.neighbours(omega);
  if (between) *between = {between->first / turn, between->second / turn};
  return between;
}

// Zero of f between two frequencies where its sign differs, by bisection on ln ω.
double crossing(const std::function<double(double)>& f, double low, double high) {
  const bool low_positive = f(low) > 0.0;
  for (int i = 0; i < 60 && high - low > 1e-14 * high; ++i) {
    const double middle = std::sqrt(low * high);
    ((f(middle) > 0.0) == low_positive ? low : high) = middle;
  }
  return std::sqrt(low * high);
}

// Largest value of f between two frequencies around a maximum, by golden section on ln ω.
double peak_between(const std::function<double(double)>& f, double low, double high) {
  const double golden = 0.5 * (std::sqrt(5.0) - 1.0);
  double a = std::log(low);
  double b = std::log(high);
  for (int i = 0; i < 60; ++i) {
    const double left = b - golden * (b - a);
    const double right = a + golden * (b - a);
    if (f(std::exp(left)) > f(std::exp(right)))
      b = right;
    else
      a = left;
  }
  return std::exp(0.5 * (a + b));
}

struct Slope {
  double gain;   // d ln|L| / d ln ω
  double phase;  // d arg L / d ln ω
};

Slope slope_at(const Curve& curve, double omega) {
  constexpr double step = 1e-6;
  const Complex change =
      std::log(curve.value(omega * std::exp(step)) / curve.value(omega * std::exp(-step)));
  return {change.real() / (2.0 * step), change.imag() / (2.0 * step)};
}

// Slope as a divisor: a figure whose slope vanishes is not determined.
double divisor(double slope) {
  return std::copysign(std::max(std::abs(slope), 1e-12), slope);
}

GainMargin gain_margin_at(const Curve& loop, double omega) {
  const CurvePoint L = loop.at(omega);
  const Slope slope = slope_at(loop, omega);
  const double phase_slope = divisor(slope.phase);
  const double by_frequency = L.scatter.variance_along({0.0, 1.0 / phase_slope});
  const double by_gain = L.scatter.variance_along({1.0, slope.gain / phase_slope});
  return {
      bounded_ratio(omega / turn, by_frequency),
      bounded(-db_per_neper * std::log(std::abs(L.value)), by_gain * db_per_neper * db_per_neper),
      between_hz(loop, omega)};
}

PhaseMargin phase_margin_at(const Curve& loop, double omega) {
  const CurvePoint L = loop.at(omega);
  const Slope slope = slope_at(loop, omega);
  const double gain_slope = divisor(slope.gain);
  const double margin = std::arg(-L.value);
  const double delay_phase = margin > 0.0 ? margin : margin + turn;
  const double by_gain = slope.phase / gain_slope;  // of the phase margin, by x: minus this
  const double delay = delay_phase / omega;
  const double delay_by_gain = (-by_gain + delay_phase / gain_slope) / omega;
  return {bounded_ratio(omega / turn, L.scatter.variance_along({1.0 / gain_slope, 0.0})),
          bounded(margin / degree, L.scatter.variance_along({-by_gain, -1.0}) / (degree * degree)),
          bounded(delay, L.scatter.variance_along({delay_by_gain, -1.0 / omega})),
          between_hz(loop, omega)};
}

void find_crossings(const Curve& loop, LoopFigures& figures) {
  const auto gain = [&](double omega) {
    return std::log(std::abs(loop.value(omega)));
  };
  const auto phase = [&](double omega) {
    return std::arg(-loop.value(omega));
  };
  const std::vector<double>& grid = loop.grid();
  for (std::size_t i = 0; i + 1 < grid.size(); ++i) {
    const Complex here = loop.value(grid[i]);
    const Complex next = loop.value(grid[i + 1]);
    if ((std::abs(here) > 1.0) != (std::abs(next) > 1.0))
      figures.gain_crossings.push_back(phase_margin_at(loop, crossing(gain, grid[i], grid[i + 1])));
    const double from = std::arg(-here);
    const double to = from + std::arg(next / here);
    if ((from > 0.0) != (to > 0.0) && std::abs(from) < pi)
      figures.phase_crossings.push_back(
          gain_margin_at(loop, crossing(phase, grid[i], grid[i + 1])));
  }
}

// At such an end the phase need not pass through 180°, but L passes through −1 as its gain changes.
void add_real_ends(const Curve& loop, LoopFigures& figures) {
  constexpr double real = 1e-6;  // part of the magnitude that is rounding
  for (const double omega : loop.real_ends()) {
    const CurvePoint L = loop.at(omega);
    if (!std::isfinite(std::abs(L.value)) || !(L.value.real() < 0.0) ||
        std::abs(L.value.imag()) > real * std::abs(L.value))
      continue;
    const double hz = omega / turn;
    const GainMargin end{{hz, hz, hz},
                         bounded(-db_per_neper * std::log(std::abs(L.value)),
                                 L.scatter.variance_along(1.0) * db_per_neper * db_per_neper),
                         std::nullopt};
    auto& all = figures.phase_crossings;
    all.insert(omega == 0.0 ? all.begin() : all.end(), end);
  }
}

void choose_margins(std::optional<bool> stable, LoopFigures& figures) {
  const double crossover_hz =
      figures.gain_crossings.empty() ? 0.0 : figures.gain_crossings.front().frequency_hz.value;
  for (const GainMargin& each : figures.phase_crossings) {
    const double margin = each.margin_db.value;
    const bool reduces =
        margin < 0.0 && (stable.value_or(false) ||
                         (each.frequency_hz.value > 0.0 && each.frequency_hz.value < crossover_hz));
    auto& least = reduces ? figures.gain_reduction : figures.gain_margin;
    if (!least || (reduces ? margin > least->margin_db.value : margin < least->margin_db.value))
      least = each;
  }
  for (const PhaseMargin& each : figures.gain_crossings) {
    if (!figures.phase_margin ||
        std::abs(each.margin_deg.value) < std::abs(figures.phase_margin->margin_deg.value))
      figures.phase_margin = each;
    if (!figures.delay_margin || each.delay_s.value < figures.delay_margin->delay_s.value)
      figures.delay_margin = each;
  }
}

SensitivityPeak peak_of_sensitivity(const Curve& loop) {
  const auto S = [&](double omega) {
    return 1.0 / std::abs(1.0 + loop.value(omega));
  };
  const std::vector<double>& grid = loop.grid();
  std::size_t top = 0;
  for (std::size_t i = 1; i < grid.size(); ++i)
    if (S(grid[i]) > S(grid[top])) top = i;
  const double omega =
      peak_between(S, grid[top == 0 ? 0 : top - 1], grid[std::min(top + 1, grid.size() - 1)]);
  const CurvePoint L = loop.at(omega);
  return {omega / turn,
          bounded_ratio(S(omega), L.scatter.variance_along(L.value / (1.0 + L.value))),
          between_hz(loop, omega)};
}

void find_bandwidth(const Curve& loop, LoopFigures& figures) {
  const auto T = [&](double omega) {
    const Complex L = loop.value(omega);
    return std::log(std::abs(L / (1.0 + L))) + 0.5 * std::numbers::ln2;
  };
  const std::vector<double>& grid = loop.grid();
  for (std::size_t i = 0; i + 1 < grid.size(); ++i) {
    if (!(T(grid[i]) > 0.0) || T(grid[i + 1]) > 0.0) continue;
    const double omega = crossing(T, grid[i], grid[i + 1]);
    constexpr double step = 1e-6;
    const double slope =
        divisor((T(omega * std::exp(step)) - T(omega * std::exp(-step))) / (2.0 * step));
    const CurvePoint L = loop.at(omega);
    figures.bandwidth_hz = bounded_ratio(
        omega / turn, L.scatter.variance_along(1.0 / (1.0 + L.value)) / (slope * slope));
    figures.bandwidth_between_hz = between_hz(loop, omega);
    return;
  }
}

}  // namespace

std::vector<Resonance> resonances(const Curve& curve) {
  const auto gain = [&](double omega) {
    return std::abs(curve.value(omega));
  };
  const std::vector<double>& grid = curve.grid();
  std::vector<double> gain_db;
  for (const double omega : grid) gain_db.push_back(20.0 * std::log10(gain(omega)));
  // The valley on one side of a peak: the lowest before the curve rises above the peak again.
  const auto valley = [&](std::size_t top, int direction) {
    double lowest = gain_db[top];
    for (auto i = static_cast<std::ptrdiff_t>(top) + direction;
         i >= 0 && i < static_cast<std::ptrdiff_t>(grid.size()); i += direction) {
      const double here = gain_db[static_cast<std::size_t>(i)];
      if (here > gain_db[top]) break;
      lowest = std::min(lowest, here);
    }
    return lowest;
  };
  std::vector<Resonance> found;
  for (std::size_t i = 1; i + 1 < grid.size(); ++i) {
    if (!(gain_db[i] > gain_db[i - 1]) || gain_db[i] < gain_db[i + 1]) continue;
    const double rise_db = gain_db[i] - std::max(valley(i, -1), valley(i, 1));
    if (rise_db < least_rise_db) continue;
    const double omega = peak_between(gain, grid[i - 1], grid[i + 1]);
    const CurvePoint G = curve.at(omega);
    found.push_back({omega / turn,
                     bounded(20.0 * std::log10(std::abs(G.value)),
                             G.scatter.gain * db_per_neper * db_per_neper),
                     rise_db, between_hz(curve, omega)});
  }
  return found;
}

LoopFigures analyse_loop(const Curve& loop, std::optional<bool> stable) {
  LoopFigures figures;
  figures.searched_to_hz = loop.grid().back() / turn;
  find_crossings(loop, figures);
  add_real_ends(loop, figures);
  choose_margins(stable, figures);
  figures.sensitivity_peak = peak_of_sensitivity(loop);
  find_bandwidth(loop, figures);
  figures.resonances = resonances(loop);
  return figures;
}

}  // namespace sinerig::identify
