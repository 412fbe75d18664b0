#include "sweep/sweep_review.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sinerig {

namespace {

// Nothing is a linear system to better than this part of the tolerance.
constexpr double floor_part = 0.1;

// A point strays from the model of the others: in sigma of both, and as a part of the tolerance. At
// 4.5 one of 25 000 points strays by chance.
constexpr double stray_sigmas = 4.5;
constexpr double stray_part = 0.5;

// What dwells know of the poles is linearised: this multiplies its variance.
constexpr double doubt = 9.0;

// Of what is left of a point when the model has taken its share: below, the others say nothing of
// it.
constexpr double least_left = 0.1;

// Lags that a probe does not always tell from dead time, without which 12 points of g1 strayed at
// 60 dB: e^{sT} of 0.6 to 4.5 ticks.
constexpr double fast[] = {0.2, 0.4, 0.6, 0.8};

constexpr double least_dof = 10.0;
constexpr int steps = 3;
constexpr double ridge = 1e-10;

}  // namespace

SweepReview::SweepReview(std::size_t dwells, std::size_t responses, double rate_hz,
                         double tolerance, Deputy::Where where)
    : period_s_{1.0 / rate_hz},
      tolerance_{tolerance},
      dwells_{dwells},
      seen_(dwells * responses),
      disagreements_(dwells),
      sums_{most_columns},
      solver_{most_columns},
      deputy_{[this] { review(); }, where} {}

void SweepReview::set(const Point& point) noexcept {
  if (point.tone > 0) return;
  Seen& seen = seen_[point.pair * dwells_ + point.dwell];
  seen.known = point.status == PointStatus::good && std::abs(point.response) > 0.0;
  if (!seen.known) return;
  seen.response = point.response;
  seen.omega_rad_s = 2.0 * std::numbers::pi * point.frequency_hz;
  const double least = floor_part * tolerance_ * std::abs(point.response);
  seen.variance = point.covariance.mean_variance() + least * least;
}

void SweepReview::ask(const ModePrior& modes) noexcept {
  modes_ = modes;
  asked_ = true;
  deputy_.ask();
}

void SweepReview::review() noexcept {
  std::fill(disagreements_.begin(), disagreements_.end(), 0.0);
  if (dwells_ == 0) return;
  parameters_ = modes_.parameters();
  const std::size_t taps = std::min<std::size_t>(most_taps, modes_.blind_ticks);
  linear_ = parameters_ + integrators + fast_lags + taps;
  columns_ = linear_ + parameters_;
  for (std::size_t response = 0; response < seen_.size() / dwells_; ++response) review(response);
}

// Complex regressors of H: linear parameters, then the poles' displacements at the present
// solution.
void SweepReview::regressors(double omega_rad_s) noexcept {
  const std::complex<double> ahead = std::polar(1.0, omega_rad_s * period_s_);
  constexpr std::complex<double> j{0.0, 1.0};
  std::size_t at = 0;
  for (std::size_t i = 0; i < modes_.modes; ++i) {
    const std::complex<double> pole{poles_[i].sigma_rad_s, poles_[i].omega_rad_s};
    const std::complex<double> z = std::exp(pole * period_s_);
    const auto gain = [&](std::complex<double> of) {
      return (1.0 - of) / (ahead - of);
    };
    const auto slope = [&](std::complex<double> of) {
      return period_s_ * of * (1.0 - ahead) / ((ahead - of) * (ahead - of));
    };
    if (poles_[i].real()) {
      row_[at] = gain(z);
      row_[linear_ + at] = beta_[at] * slope(z);
      at += 1;
    } else {
      const std::complex<double> other = std::conj(z);
      const std::complex<double> residue{beta_[at], beta_[at + 1]};
      row_[at] = gain(z) + gain(other);
      row_[at + 1] = j * (gain(z) - gain(other));
      const std::complex<double> one = residue * slope(z);
      const std::complex<double> two = std::conj(residue) * slope(other);
      row_[linear_ + at] = one + two;
      row_[linear_ + at + 1] = j * (one - two);
      at += 2;
    }
  }
  const std::complex<double> integrator = period_s_ / (ahead - 1.0);
  row_[at++] = integrator;
  row_[at++] = integrator * integrator;
  for (const double z : fast) row_[at++] = (1.0 - z) / (ahead - z);
  std::complex<double> tap = 1.0;
  for (; at < linear_; ++at, tap /= ahead) row_[at] = tap;
}

// One Gauss-Newton step: beta_ holds the linear parameters, then how far the poles are to move.
bool SweepReview::fit(std::size_t response) noexcept {
  std::fill(sums_.gram.begin(), sums_.gram.end(), 0.0);
  std::fill(sums_.moments.begin(), sums_.moments.end(), 0.0);
  for (std::size_t dwell = 0; dwell < dwells_; ++dwell) {
    const Seen& seen = seen_[response * dwells_ + dwell];
    if (!seen.known) continue;
    regressors(seen.omega_rad_s);
    for (std::size_t i = 0; i < columns_; ++i) {
      const std::complex<double> weighted = std::conj(row_[i]) / seen.variance;
      for (std::size_t k = 0; k <= i; ++k)
        sums_.gram[triangle(i) + k] += (weighted * row_[k]).real();
      sums_.moments[i] += (weighted * seen.response).real();
    }
  }
  for (std::size_t i = 0; i < columns_; ++i) sums_.gram[triangle(i) + i] *= 1.0 + ridge;
  for (std::size_t i = 0; i < parameters_; ++i) {
    const double precision = 1.0 / (doubt * modes_.covariance[triangle(i) + i]);
    sums_.gram[triangle(linear_ + i) + linear_ + i] += precision;
    sums_.moments[linear_ + i] -= precision * moved_[i];
  }
  if (!solver_.factor(sums_.gram, columns_)) return false;
  std::copy_n(sums_.moments.begin(), columns_, beta_.begin());
  solver_.solve({beta_.data(), columns_});
  return true;
}

void SweepReview::review(std::size_t response) noexcept {
  double known = 0.0;
  for (std::size_t dwell = 0; dwell < dwells_; ++dwell)
    known += seen_[response * dwells_ + dwell].known ? 1.0 : 0.0;
  if (2.0 * known - static_cast<double>(linear_) < least_dof) return;
  std::copy(modes_.poles.begin(), modes_.poles.end(), poles_.begin());
  moved_ = {};
  beta_ = {};
  for (int step = 0; step <= steps; ++step) {
    if (!fit(response)) return;
    if (step == steps) break;
    std::size_t at = 0;
    for (std::size_t i = 0; i < modes_.modes; ++i) {
      for (std::size_t k = 0; k < poles_[i].size(); ++k) moved_[at + k] += beta_[linear_ + at + k];
      poles_[i].sigma_rad_s = modes_.poles[i].sigma_rad_s + moved_[at];
      if (!poles_[i].real()) poles_[i].omega_rad_s = modes_.poles[i].omega_rad_s + moved_[at + 1];
      at += poles_[i].size();
    }
  }
  const std::array<double, most_columns> solution = beta_;
  for (std::size_t dwell = 0; dwell < dwells_; ++dwell) {
    const Seen& seen = seen_[response * dwells_ + dwell];
    if (!seen.known) continue;
    regressors(seen.omega_rad_s);
    compare(seen, disagreements_[dwell]);
    beta_ = solution;
  }
}

// The deleted residual of a point, (1 − X C Xᵀ / v)⁻¹ e, and its statistic.
void SweepReview::compare(const Seen& seen, double& disagreement) noexcept {
  std::complex<double> error = seen.response;
  for (std::size_t i = 0; i < columns_; ++i) error -= beta_[i] * row_[i];
  std::array<std::array<double, 2>, 2> left{{{1.0, 0.0}, {0.0, 1.0}}};
  for (std::size_t part = 0; part < 2; ++part) {
    for (std::size_t i = 0; i < columns_; ++i)
      beta_[i] = part == 0 ? row_[i].real() : row_[i].imag();
    solver_.solve({beta_.data(), columns_});
    for (std::size_t i = 0; i < columns_; ++i) {
      left[part][0] -= beta_[i] * row_[i].real() / seen.variance;
      left[part][1] -= beta_[i] * row_[i].imag() / seen.variance;
    }
  }
  const double middle = 0.5 * (left[0][0] + left[1][1]);
  const double apart = std::hypot(0.5 * (left[0][0] - left[1][1]), left[0][1]);
  if (middle - apart < least_left) return;
  const double determinant = left[0][0] * left[1][1] - left[0][1] * left[1][0];
  const std::complex<double> deleted{
      (left[1][1] * error.real() - left[0][1] * error.imag()) / determinant,
      (left[0][0] * error.imag() - left[1][0] * error.real()) / determinant};
  const double square =
      (deleted.real() * error.real() + deleted.imag() * error.imag()) / seen.variance;
  const double size = std::abs(deleted) / std::abs(seen.response);
  if (square > stray_sigmas * stray_sigmas && size > stray_part * tolerance_) {
    disagreement = std::max(disagreement, size);
  }
}

}  // namespace sinerig
