// The poles of modelled dwells: what is believed of them, where the regression is linear in them,
// and what one dwell hands to the next.
#include <algorithm>
#include <cmath>

#include "sweep/modal_settling.h"

namespace sinerig {

namespace {

// A pole this far from where the regression is linear, in radians over the time that its transient
// is seen, and with a second-order term of this many sigma, is linearised at again.
constexpr double far_rad = 0.06;
constexpr double seen_sigmas = 0.2;
constexpr int most_linearisations = 12;
constexpr int most_at_once = 8;
constexpr double least_damping_factor = 0.3;
constexpr double most_damping_factor = 3.0;

// Where the residual says that the poles are others their variance is multiplied by this.
constexpr double doubted_variance = 100.0;

// What a dwell knows of the poles is a little less sure in the next.
constexpr double forgetting = 1.05 * 1.05;

// No pole is believed to be known less than this, relative to its decay and frequency: further off
// the regression says nothing of it.
constexpr double least_known_real = 0.3;
constexpr double least_known_decay = 0.6;
constexpr double least_known_turn = 0.1;

}  // namespace

void ModalSettling::know(const ModePrior& prior, std::span<const double> noise_variance,
                         double noise_dof) noexcept {
  prior_ = prior;
  known_ = true;
  std::size_t index = 0;
  for (const ModePole& pole : prior_.known()) {
    const double size = std::abs(pole.sigma_rad_s);
    most_variance_[index] =
        std::pow((pole.real() ? least_known_real : least_known_decay) * size, 2);
    if (!pole.real()) {
      most_variance_[index + 1] = std::pow(least_known_turn * pole.omega_rad_s, 2);
    }
    index += pole.size();
  }
  limit_doubt();
  for (std::size_t i = 0; i < prior_.parameters(); ++i) {
    most_variance_[i] = prior_.covariance[triangle(i) + i];
  }
  for (std::size_t i = 0; i < noise_.size(); ++i) noise_[i] = {noise_variance[i], noise_dof};
}

// Forgetting must not make a pole that dwells hardly see less known than it was at first: it would
// wander off and become a trend.
void ModalSettling::limit_doubt() noexcept {
  const std::size_t parameters = prior_.parameters();
  for (std::size_t i = 0; i < parameters; ++i) {
    const double variance = prior_.covariance[triangle(i) + i];
    if (!(variance > most_variance_[i])) continue;
    const double scale = std::sqrt(most_variance_[i] / variance);
    for (std::size_t j = 0; j < parameters; ++j) {
      prior_.covariance[j <= i ? triangle(i) + j : triangle(j) + i] *=
          j == i ? scale * scale : scale;
    }
  }
}

// The precision of the poles by inverting their covariance.
void ModalSettling::believe() noexcept {
  const std::size_t parameters = prior_.parameters();
  NormalSums& scratch = inverse_sums_;
  std::copy_n(prior_.covariance.begin(), triangle(parameters), scratch.gram.begin());
  belief_ = {};
  if (!inverse_.factor(scratch.gram, parameters)) {
    // Dependent poles: each by itself.
    for (std::size_t i = 0; i < parameters; ++i) {
      belief_.precision[triangle(i) + i] = 1.0 / prior_.covariance[triangle(i) + i];
    }
    return;
  }
  for (std::size_t i = 0; i < parameters; ++i) {
    std::span<double> column{scratch.moments.data(), parameters};
    std::fill(column.begin(), column.end(), 0.0);
    column[i] = 1.0;
    inverse_.solve(column);
    for (std::size_t j = 0; j <= i; ++j) belief_.precision[triangle(i) + j] = column[j];
  }
}

void ModalSettling::relinearise_regression() noexcept {
  regression_.linearise({poles_.data(), prior_.modes}, 1.0 / rate_hz_, task_.omega_rad_s);
}

bool ModalSettling::solve_window() noexcept {
  std::size_t index = 0;
  for (std::size_t i = 0; i < prior_.modes; ++i) {
    belief_.mean[index] = prior_.poles[i].sigma_rad_s - poles_[i].sigma_rad_s;
    if (!poles_[i].real()) {
      belief_.mean[index + 1] = prior_.poles[i].omega_rad_s - poles_[i].omega_rad_s;
    }
    index += poles_[i].size();
  }
  total(0, window_);
  return solver_.solve(window_, {poles_.data(), prior_.modes}, belief_, expected_noise(0),
                       solution_);
}

bool ModalSettling::needs_other_poles() const noexcept {
  const double sigma = std::sqrt(expected_noise(0));
  const auto begin = static_cast<double>(blocks_.edge[0]);
  const double seconds =
      static_cast<double>(blocks_.edge[block_count_] - blocks_.edge[0]) / rate_hz_;
  std::size_t index = 0;
  for (std::size_t i = 0; i < prior_.modes; ++i) {
    const ModePole& pole = poles_[i];
    const double* a = &solution_.amplitudes[index];
    const double* d = &solution_.moved[index];
    const double size = pole.real() ? std::abs(a[0]) : std::hypot(a[0], a[1]);
    const double move = pole.real() ? std::abs(d[0]) : std::hypot(d[0], d[1]);
    index += pole.size();
    // Amplitudes are those at the start of the dwell.
    const double left = size * std::exp(pole.sigma_rad_s * begin / rate_hz_);
    const double decay = pole.sigma_rad_s < 0.0 ? -2.0 / pole.sigma_rad_s : seconds;
    const double te = std::min(seconds, decay);
    const double turned = move * (te + begin / rate_hz_);
    if (turned > far_rad &&
        left * turned * turned / 2.0 * std::sqrt(te * rate_hz_ / 2.0) > seen_sigmas * sigma) {
      return true;
    }
  }
  return false;
}

void ModalSettling::linearise_again(const ModalStore& store, std::size_t channel) noexcept {
  std::size_t index = 0;
  for (std::size_t i = 0; i < prior_.modes; ++i) {
    const ModePole& known = prior_.poles[i];
    const double sigma = poles_[i].sigma_rad_s + solution_.moved[index];
    const double a = least_damping_factor * known.sigma_rad_s;
    const double b = most_damping_factor * known.sigma_rad_s;
    poles_[i].sigma_rad_s = std::clamp(sigma, std::min(a, b), std::max(a, b));
    if (!known.real()) {
      const double omega = poles_[i].omega_rad_s + solution_.moved[index + 1];
      poles_[i].omega_rad_s = std::clamp(omega, 0.5 * known.omega_rad_s, 2.0 * known.omega_rad_s);
    }
    index += known.size();
  }
  relinearise_regression();
  for (std::size_t i = 0; i < block_count_; ++i) {
    accumulate(store, channel, blocks_.edge[i], blocks_.edge[i + 1], blocks_.sums[i]);
  }
}

// Solved, linear where the poles stand. False where the window does not determine the tone.
bool ModalSettling::settle_poles(const ModalStore& store) noexcept {
  if (!solve_window()) return false;
  for (int again = 0;
       again < most_at_once && needs_other_poles() && linearisations_ < most_linearisations;
       ++again) {
    ++linearisations_;
    linearise_again(store, outputs_[0]);
    if (!solve_window()) return false;
  }
  return true;
}

// The modes may be right and their poles have moved further than was believed: once a dwell they
// are looked for from the beginning, with less belief in what was known of them.
void ModalSettling::doubt_poles(const ModalStore& store) noexcept {
  doubted_poles_ = true;
  for (double& each : belief_.precision) each /= doubted_variance;
  linearisations_ = 0;
  std::copy(prior_.poles.begin(), prior_.poles.end(), poles_.begin());
  relinearise_regression();
  for (std::size_t i = 0; i < block_count_; ++i) {
    accumulate(store, outputs_[0], blocks_.edge[i], blocks_.edge[i + 1], blocks_.sums[i]);
  }
}

// What the dwell has taught of the poles is where the next begins.
void ModalSettling::move_prior() noexcept {
  std::size_t index = 0;
  for (std::size_t i = 0; i < prior_.modes; ++i) {
    const double sigma = poles_[i].sigma_rad_s + solution_.moved[index];
    if (sigma < 0.0 || prior_.poles[i].sigma_rad_s >= 0.0) prior_.poles[i].sigma_rad_s = sigma;
    if (!poles_[i].real()) {
      prior_.poles[i].omega_rad_s = poles_[i].omega_rad_s + solution_.moved[index + 1];
    }
    index += poles_[i].size();
  }
  for (std::size_t i = 0; i < triangle(prior_.parameters()); ++i) {
    prior_.covariance[i] = forgetting * posterior_[i];
  }
  limit_doubt();
}

}  // namespace sinerig
