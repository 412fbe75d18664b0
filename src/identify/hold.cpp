#include "identify/hold.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "identify/sampled_terms.h"

namespace sinerig::identify {

namespace {

using Complex = std::complex<double>;

constexpr std::size_t most_at_origin = 4;  // three poles of the plant and the one of the step

// Poles and zeros of G(s)/s with those at the origin counted, a common one cancelled.
struct StepTransform {
  std::vector<Complex> zeros;
  std::vector<Complex> poles;
  std::size_t at_origin = 1;
  double gain;

  explicit StepTransform(const ZerosPolesGain& plant) : gain(plant.gain) {
    for (const Complex pole : plant.poles) {
      if (pole == 0.0)
        ++at_origin;
      else
        poles.push_back(pole);
    }
    for (const Complex zero : plant.zeros) {
      if (zero == 0.0 && at_origin > 0)
        --at_origin;
      else
        zeros.push_back(zero);
    }
  }

  // Without the poles at the origin and without the pole left out.
  Complex away_from(Complex s, std::size_t left_out) const {
    Complex value = gain;
    std::size_t z = 0;
    for (std::size_t p = 0; p < poles.size(); ++p) {
      if (p == left_out) continue;
      value /= s - poles[p];
      if (z < zeros.size()) value *= s - zeros[z++];
    }
    while (z < zeros.size()) value *= s - zeros[z++];
    return value;
  }

  Complex residue(std::size_t p) const {
    return away_from(poles[p], p) / std::pow(poles[p], static_cast<double>(at_origin));
  }

  // First terms of the Taylor series at 0 of what stands beside s^−at_origin.
  std::vector<Complex> series_at_origin() const {
    std::vector<Complex> series(at_origin, 0.0);
    if (series.empty()) return series;
    series[0] = gain;
    for (const Complex zero : zeros) {
      for (std::size_t i = series.size(); i-- > 0;)
        series[i] = -zero * series[i] + (i > 0 ? series[i - 1] : 0.0);
    }
    for (const Complex pole : poles) {
      for (std::size_t i = 0; i < series.size(); ++i)
        series[i] = (series[i] - (i > 0 ? series[i - 1] : 0.0)) / -pole;
    }
    return series;
  }
};

void check(const ZerosPolesGain& plant, double period_s, const StepTransform& step) {
  if (!(period_s > 0.0) || !std::isfinite(period_s))
    throw std::invalid_argument("hold: a period of " + std::to_string(period_s) +
                                " s; it must be above zero");
  if (plant.zeros.size() > plant.poles.size())
    throw std::invalid_argument("hold: " + std::to_string(plant.zeros.size()) + " zeros over " +
                                std::to_string(plant.poles.size()) +
                                " poles; behind a hold the plant must be proper");
  if (step.at_origin > most_at_origin)
    throw std::invalid_argument("hold: more than three poles at the origin are not supported");
}

}  // namespace

std::complex<double> hold_factor(double omega_rad_s, double period_s) {
  const double half = 0.5 * omega_rad_s * period_s;
  return std::polar(std::sin(half) / half, -half);
}

Eigen::ArrayXcd held_response(const ZerosPolesGain& plant, double period_s,
                              const Eigen::ArrayXd& omega_rad_s) {
  const StepTransform step(plant);
  check(plant, period_s, step);
  const TickDelay delay(plant.delay_s, period_s);
  const std::vector<Complex> series = step.series_at_origin();
  std::vector<Complex> residues(step.poles.size());
  for (std::size_t p = 0; p < residues.size(); ++p) residues[p] = step.residue(p);
  Eigen::ArrayXcd response(omega_rad_s.size());
  for (Eigen::Index i = 0; i < omega_rad_s.size(); ++i) {
    const Complex z_inverse = std::polar(1.0, -omega_rad_s[i] * period_s);
    Complex sum = 0.0;
    for (std::size_t p = 0; p < residues.size(); ++p)
      sum += residues[p] *
             sampled_exponential(step.poles[p], delay.fraction, period_s, z_inverse).value;
    for (std::size_t j = 0; j < series.size(); ++j) {
      const int q = static_cast<int>(series.size() - 1 - j);
      sum += series[j] * sampled_power(q, delay.fraction, period_s, z_inverse);
    }
    const Complex whole_delay = std::polar(1.0, -omega_rad_s[i] * period_s * delay.whole_ticks);
    response[i] = (1.0 - z_inverse) * sum * whole_delay;
  }
  return response;
}

}  // namespace sinerig::identify
