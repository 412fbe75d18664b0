// A response with its scatter that can be asked at any frequency: what loop analysis works on,
// whether it comes from measured points or from a model.
#pragma once

#include <complex>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "identify/response.h"

namespace sinerig::identify {

// Covariance of (ln|G|, arg G): nepers and radians, squared.
struct LogScatter {
  double gain = 0.0;
  double both = 0.0;
  double phase = 0.0;

  // Variance of Re(factor · δ ln G): to first order any real figure of G is of this form.
  double variance_along(std::complex<double> factor) const;
  LogScatter operator+(const LogScatter& other) const;
};

// That of a point whose covariance is of (re, im): δ ln G = δG/G.
LogScatter log_scatter(const ResponsePoint& point);

struct CurvePoint {
  std::complex<double> value;
  LogScatter scatter;
};

class Curve {
 public:
  using Value = std::function<std::complex<double>(double omega_rad_s)>;
  using Scatter = std::function<LogScatter(double omega_rad_s)>;

  // Between the points ln|G| and the phase, unwrapped by the shortest way, run straight over ln ω;
  // the two neighbours scatter independently. Beyond the ends the last value holds.
  // Throws std::invalid_argument for fewer than two points, and as check_response does.
  static Curve of_points(const Response& points);
  // grid: ascending frequencies in rad/s, dense enough that nothing crosses twice in between.
  static Curve of_model(Value value, Scatter scatter, std::vector<double> grid);

  CurvePoint at(double omega_rad_s) const { return {value_(omega_rad_s), scatter_(omega_rad_s)}; }
  std::complex<double> value(double omega_rad_s) const { return value_(omega_rad_s); }
  const std::vector<double>& grid() const { return grid_; }

  // Frequencies in rad/s at the ends of what there is, 0 or half a rate, where the response is
  // real: it may lie on the negative axis there without crossing it.
  const std::vector<double>& real_ends() const { return real_ends_; }
  Curve with_real_ends(std::vector<double> omega_rad_s) const;

  // The measured frequencies, rad/s, between which a value at omega is interpolated.
  std::optional<std::pair<double, double>> neighbours(double omega_rad_s) const;

  // The product; relative errors of the two are independent and add. Asked where both are known.
  // Throws std::invalid_argument where the two have no frequencies in common.
  Curve times(const Curve& other) const;
  // The same curve through an analytic function of the response: value f(G), slope df/dG.
  Curve mapped(const std::function<std::complex<double>(std::complex<double>)>& f,
               const std::function<std::complex<double>(std::complex<double>)>& slope) const;

 private:
  Value value_;
  Scatter scatter_;
  std::vector<double> grid_;
  std::vector<double> measured_;  // rad/s; empty for a model
  std::vector<double> real_ends_;
};

// Logarithmic from first to last, rad/s, and close to each of the roots as their damping asks.
std::vector<double> model_grid(double first_rad_s, double last_rad_s,
                               const std::vector<std::complex<double>>& roots);

}  // namespace sinerig::identify
