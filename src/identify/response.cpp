#include "identify/response.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <string>

namespace sinerig::identify {

namespace {

bool scatter_known(const ResponsePoint& point) {
  return point.variance_re > 0.0 && point.variance_im > 0.0;
}

[[noreturn]] void refuse(std::size_t index, const ResponsePoint& point, const std::string& what) {
  std::ostringstream message;
  message.precision(10);
  message << "response point " << index + 1 << " (" << point.omega_rad_s / (2.0 * std::numbers::pi)
          << " Hz): " << what;
  throw std::invalid_argument(message.str());
}

void check_point(const Response& response, std::size_t i) {
  const ResponsePoint& point = response[i];
  if (!std::isfinite(point.omega_rad_s) || point.omega_rad_s <= 0.0)
    refuse(i, point, "the frequency must be finite and above zero; remove the point");
  if (i > 0 && point.omega_rad_s == response[i - 1].omega_rad_s)
    refuse(i, point, "the frequency occurs twice; merge the two points or remove one");
  if (i > 0 && point.omega_rad_s < response[i - 1].omega_rad_s)
    refuse(i, point, "the frequencies must ascend; sort the points");
  if (!std::isfinite(point.response.real()) || !std::isfinite(point.response.imag()))
    refuse(i, point, "the response is not finite; remove the point");
  if (point.response == 0.0)
    refuse(i, point, "the response is exactly zero, so no relative error exists; remove the point");
  const double product = point.variance_re * point.variance_im;
  const bool finite = std::isfinite(product) && std::isfinite(point.covariance);
  if (!finite || point.variance_re < 0.0 || point.variance_im < 0.0 ||
      point.covariance * point.covariance > product * (1.0 + 1e-9))
    refuse(i, point, "the covariance must be finite and positive semidefinite; check its unit");
  if (scatter_known(point) != scatter_known(response.front()))
    refuse(i, point,
           "scatter must be given for every point or for none; fill in or remove the deviations");
}

}  // namespace

ResponsePoint point_with_relative_scatter(double omega_rad_s, std::complex<double> response,
                                          double sigma_rel) {
  const double variance = std::norm(response) * sigma_rel * sigma_rel;
  return {omega_rad_s, response, variance, 0.0, variance};
}

bool has_scatter(const Response& response) {
  return !response.empty() && std::all_of(response.begin(), response.end(), scatter_known);
}

void check_response(const Response& response, std::size_t minimum_points) {
  const auto is_zero = [](const ResponsePoint& point) {
    return point.response == 0.0;
  };
  if (!response.empty() && std::all_of(response.begin(), response.end(), is_zero))
    throw std::invalid_argument(
        "response: every point is zero; check that the right channels were recorded");
  for (std::size_t i = 0; i < response.size(); ++i) check_point(response, i);
  if (response.size() < minimum_points)
    throw std::invalid_argument("response: " + std::to_string(response.size()) +
                                " points, but the model asked for needs at least " +
                                std::to_string(minimum_points) +
                                "; lower the orders or measure more points");
}

}  // namespace sinerig::identify
