// A measured frequency response: what identification starts from.
#pragma once

#include <complex>
#include <cstddef>
#include <vector>

namespace sinerig::identify {

// H(jω) at one frequency with the absolute 2×2 covariance of (re, im) of the mean, in the squared
// unit of H. All three zero: the scatter is unknown.
struct ResponsePoint {
  double omega_rad_s = 0.0;
  std::complex<double> response;
  double variance_re = 0.0;
  double covariance = 0.0;
  double variance_im = 0.0;
};

// Points in ascending frequency.
using Response = std::vector<ResponsePoint>;

// A point whose relative gain and phase in rad each have standard deviation sigma_rel (circular).
ResponsePoint point_with_relative_scatter(double omega_rad_s, std::complex<double> response,
                                          double sigma_rel);

// True when every point carries its scatter.
bool has_scatter(const Response& response);

// Refuses, with std::invalid_argument naming the point, the value, the rule and the remedy: fewer
// than minimum_points; a frequency that is not finite, not positive, duplicate or out of order; a
// response that is not finite or is zero; a covariance that is not finite or not positive
// semidefinite; scatter on some points but not on others.
void check_response(const Response& response, std::size_t minimum_points);

}  // namespace sinerig::identify
