#include "sweep/modal_regression.h"

#include <algorithm>
#include <cmath>

namespace sinerig {

namespace {

// Rotations between two exact exponentials: their rounding stays below 1e-14.
constexpr std::uint64_t anchor_ticks = 64;

}  // namespace

void ModalSums::clear(std::size_t columns) noexcept {
  std::fill_n(gram.begin(), triangle(columns), 0.0);
  std::fill_n(moments.begin(), columns, 0.0);
  square = 0.0;
  count = 0.0;
}

void ModalSums::add(const ModalSums& other, std::size_t columns) noexcept {
  for (std::size_t i = 0; i < triangle(columns); ++i) gram[i] += other.gram[i];
  for (std::size_t i = 0; i < columns; ++i) moments[i] += other.moments[i];
  square += other.square;
  count += other.count;
}

void ModalRegression::linearise(std::span<const ModePole> poles, double period_s,
                                double omega_rad_s) noexcept {
  period_s_ = period_s;
  omega_rad_s_ = omega_rad_s;
  modes_ = poles.size();
  columns_ = tone_columns;
  for (std::size_t i = 0; i < modes_; ++i) {
    Mode& mode = mode_[i];
    mode.pole = poles[i];
    const double decay = std::exp(mode.pole.sigma_rad_s * period_s);
    mode.step_re = decay * std::cos(mode.pole.omega_rad_s * period_s);
    mode.step_im = decay * std::sin(mode.pole.omega_rad_s * period_s);
    columns_ += 2 * mode.pole.size();
  }
  tick_ = 0;
  anchor();
}

void ModalRegression::anchor() noexcept {
  anchored_ = tick_;
  const double t = static_cast<double>(tick_) * period_s_;
  for (std::size_t i = 0; i < modes_; ++i) {
    Mode& mode = mode_[i];
    const double decay = std::exp(mode.pole.sigma_rad_s * t);
    mode.re = decay * std::cos(mode.pole.omega_rad_s * t);
    mode.im = decay * std::sin(mode.pole.omega_rad_s * t);
  }
}

void ModalRegression::go_to(std::uint64_t tick) noexcept {
  const bool next = tick == tick_ + 1 && tick < anchored_ + anchor_ticks;
  tick_ = tick;
  if (!next) {
    anchor();
    return;
  }
  for (std::size_t i = 0; i < modes_; ++i) {
    Mode& mode = mode_[i];
    const double re = mode.re * mode.step_re - mode.im * mode.step_im;
    mode.im = mode.re * mode.step_im + mode.im * mode.step_re;
    mode.re = re;
  }
}

void ModalRegression::set_regressors(const ModalSample& sample) noexcept {
  const bool on_grid = sample.off_grid_s == 0.0;
  double cosine = sample.tone.cosine;
  double sine = sample.tone.sine;
  if (!on_grid) {
    const double c = std::cos(omega_rad_s_ * sample.off_grid_s);
    const double s = std::sin(omega_rad_s_ * sample.off_grid_s);
    cosine = sample.tone.cosine * c - sample.tone.sine * s;
    sine = sample.tone.sine * c + sample.tone.cosine * s;
  }
  x_[0] = cosine;
  x_[1] = sine;
  x_[2] = 1.0;
  const double t = static_cast<double>(tick_) * period_s_ + sample.off_grid_s;
  double* x = &x_[tone_columns];
  for (std::size_t i = 0; i < modes_; ++i) {
    const Mode& mode = mode_[i];
    double re = mode.re;
    double im = mode.im;
    if (!on_grid) {
      const double decay = std::exp(mode.pole.sigma_rad_s * sample.off_grid_s);
      const double c = decay * std::cos(mode.pole.omega_rad_s * sample.off_grid_s);
      const double s = decay * std::sin(mode.pole.omega_rad_s * sample.off_grid_s);
      re = mode.re * c - mode.im * s;
      im = mode.im * c + mode.re * s;
    }
    if (mode.pole.real()) {
      x[0] = re;
      x[1] = t * re;
      x += 2;
    } else {
      x[0] = re;
      x[1] = im;
      x[2] = t * re;
      x[3] = t * im;
      x += 4;
    }
  }
}

void ModalRegression::add(const ModalSample& sample, ModalSums& sums) noexcept {
  set_regressors(sample);
  double* gram = sums.gram.data();
  for (std::size_t i = 0; i < columns_; ++i) {
    const double factor = x_[i];
    for (std::size_t j = 0; j <= i; ++j) gram[j] += factor * x_[j];
    gram += i + 1;
    sums.moments[i] += factor * sample.value;
  }
  sums.square += sample.value * sample.value;
  sums.count += 1.0;
}

}  // namespace sinerig
