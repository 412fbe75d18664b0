#include "identify/loop_curve.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace sinerig::identify {

namespace {

using Complex = std::complex<double>;

constexpr int subdivisions = 8;  // of the gap between two measured points
constexpr int points_per_decade = 400;

struct LogPoints {
  std::vector<double> ln_omega;
  std::vector<double> ln_gain;
  std::vector<double> phase;
  std::vector<LogScatter> scatter;

  explicit LogPoints(const Response& points) {
    constexpr double turn = 2.0 * std::numbers::pi;
    for (const ResponsePoint& point : points) {
      double angle = std::arg(point.response);
      if (!phase.empty()) angle += turn * std::round((phase.back() - angle) / turn);
      ln_omega.push_back(std::log(point.omega_rad_s));
      ln_gain.push_back(std::log(std::abs(point.response)));
      phase.push_back(angle);
      scatter.push_back(log_scatter(point));
    }
  }

  // Index of the left neighbour and the part of the gap that lies behind.
  std::pair<std::size_t, double> place(double omega) const {
    const double x = std::clamp(std::log(omega), ln_omega.front(), ln_omega.back());
    const auto right = std::upper_bound(ln_omega.begin() + 1, ln_omega.end() - 1, x);
    const auto i = static_cast<std::size_t>(right - ln_omega.begin()) - 1;
    return {i, (x - ln_omega[i]) / (ln_omega[i + 1] - ln_omega[i])};
  }

  Complex value(double omega) const {
    const auto [i, t] = place(omega);
    return std::polar(std::exp(std::lerp(ln_gain[i], ln_gain[i + 1], t)),
                      std::lerp(phase[i], phase[i + 1], t));
  }

  LogScatter scatter_at(double omega) const {
    const auto [i, t] = place(omega);
    const double left = (1.0 - t) * (1.0 - t);
    const double right = t * t;
    const LogScatter& a = scatter[i];
    const LogScatter& b = scatter[i + 1];
    return {left * a.gain + right * b.gain, left * a.both + right * b.both,
            left * a.phase + right * b.phase};
  }
};

std::vector<double> merged_grid(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.back() <= b.front() || b.back() <= a.front())
    throw std::invalid_argument(
        "loop: the two responses have no frequencies in common; measure them over the same range");
  const double first = std::max(a.front(), b.front());
  const double last = std::min(a.back(), b.back());
  std::vector<double> grid;
  std::merge(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(grid));
  std::erase_if(grid, [&](double omega) { return omega < first || omega > last; });
  grid.erase(std::unique(grid.begin(), grid.end()), grid.end());
  return grid;
}

}  // namespace

// In this order std::max lets a variance that is not a number through.
double LogScatter::variance_along(Complex factor) const {
  const double re = factor.real();
  const double im = factor.imag();
  return std::max(re * re * gain - 2.0 * re * im * both + im * im * phase, 0.0);
}

LogScatter LogScatter::operator+(const LogScatter& other) const {
  return {gain + other.gain, both + other.both, phase + other.phase};
}

LogScatter log_scatter(const ResponsePoint& point) {
  const Complex inverse = 1.0 / point.response;
  const double c = inverse.real();
  const double s = inverse.imag();
  const double rr = point.variance_re;
  const double ri = point.covariance;
  const double ii = point.variance_im;
  return {c * c * rr - 2.0 * c * s * ri + s * s * ii,
          c * s * rr + (c * c - s * s) * ri - c * s * ii,
          s * s * rr + 2.0 * c * s * ri + c * c * ii};
}

Curve Curve::of_points(const Response& points) {
  check_response(points, 2);
  const auto logs = std::make_shared<const LogPoints>(points);
  Curve curve;
  curve.value_ = [logs](double omega) {
    return logs->value(omega);
  };
  curve.scatter_ = [logs](double omega) {
    return logs->scatter_at(omega);
  };
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double here = points[i].omega_rad_s;
    curve.measured_.push_back(here);
    curve.grid_.push_back(here);
    if (i + 1 == points.size()) break;
    const double ratio = points[i + 1].omega_rad_s / here;
    for (int k = 1; k < subdivisions; ++k)
      curve.grid_.push_back(here * std::pow(ratio, static_cast<double>(k) / subdivisions));
  }
  return curve;
}

Curve Curve::of_model(Value value, Scatter scatter, std::vector<double> grid) {
  Curve curve;
  curve.value_ = std::move(value);
  curve.scatter_ = std::move(scatter);
  curve.grid_ = std::move(grid);
  return curve;
}

std::optional<std::pair<double, double>> Curve::neighbours(double omega_rad_s) const {
  if (measured_.empty()) return std::nullopt;
  const auto right = std::lower_bound(measured_.begin(), measured_.end(), omega_rad_s);
  if (right == measured_.end()) return std::pair{measured_.back(), measured_.back()};
  if (*right == omega_rad_s || right == measured_.begin()) return std::pair{*right, *right};
  return std::pair{*(right - 1), *right};
}

Curve Curve::with_real_ends(std::vector<double> omega_rad_s) const {
  Curve ended = *this;
  ended.real_ends_ = std::move(omega_rad_s);
  return ended;
}

Curve Curve::times(const Curve& other) const {
  Curve product;
  product.value_ = [a = value_, b = other.value_](double omega) {
    return a(omega) * b(omega);
  };
  product.scatter_ = [a = scatter_, b = other.scatter_](double omega) {
    return a(omega) + b(omega);
  };
  product.grid_ = merged_grid(grid_, other.grid_);
  product.measured_ = measured_;
  product.measured_.insert(product.measured_.end(), other.measured_.begin(), other.measured_.end());
  std::sort(product.measured_.begin(), product.measured_.end());
  return product;
}

Curve Curve::mapped(const std::function<Complex(Complex)>& f,
                    const std::function<Complex(Complex)>& slope) const {
  Curve image;
  image.value_ = [f, value = value_](double omega) {
    return f(value(omega));
  };
  image.scatter_ = [f, slope, value = value_, scatter = scatter_](double omega) {
    const Complex G = value(omega);
    const Complex factor = slope(G) * G / f(G);  // δ ln f = factor · δ ln G
    const LogScatter before = scatter(omega);
    const double c = factor.real();
    const double s = factor.imag();
    return LogScatter{before.variance_along(factor),
                      c * s * before.gain + (c * c - s * s) * before.both - c * s * before.phase,
                      s * s * before.gain + 2.0 * c * s * before.both + c * c * before.phase};
  };
  image.grid_ = grid_;
  image.measured_ = measured_;
  return image;
}

std::vector<double> model_grid(double first_rad_s, double last_rad_s,
                               const std::vector<Complex>& roots) {
  std::vector<double> grid;
  const double decades = std::log10(last_rad_s / first_rad_s);
  const int steps = std::max(2, static_cast<int>(std::ceil(decades * points_per_decade)));
  for (int i = 0; i <= steps; ++i)
    grid.push_back(first_rad_s *
                   std::pow(last_rad_s / first_rad_s, static_cast<double>(i) / steps));
  grid.back() = last_rad_s;
  for (const Complex root : roots) {
    const double omega = std::abs(root.imag());
    const double width = std::max(std::abs(root.real()), 1e-9 * omega);
    for (double offset = 0.125; offset < 40.0; offset *= std::numbers::sqrt2) {
      grid.push_back(omega - offset * width);
      grid.push_back(omega + offset * width);
    }
    grid.push_back(omega);
  }
  std::erase_if(grid, [&](double omega) { return !(omega >= first_rad_s && omega <= last_rad_s); });
  std::sort(grid.begin(), grid.end());
  grid.erase(std::unique(grid.begin(), grid.end()), grid.end());
  return grid;
}

}  // namespace sinerig::identify
