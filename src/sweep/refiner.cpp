#include "sweep/refiner.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace sinerig {

namespace {

constexpr double db_per_relative = 20.0 / std::numbers::ln10;

// Places in a gap where the two models are compared, beside their poles.
constexpr int looks = 15;

// A disagreement counts when it is this many times what the noise of the points makes of it.
constexpr double noise_factor = 3.0;

}  // namespace

// In the frequency itself, not in s = jω: the factor j goes into the coefficients.
std::complex<double> Refiner::Model::at(double frequency_hz) const noexcept {
  return (alpha + beta * frequency_hz) / (1.0 + gamma * frequency_hz);
}

double Refiner::Model::pole_hz() const noexcept {
  return (-1.0 / gamma).real();
}

// α + β f − γ f H = H at three points; differences against the first eliminate α.
Refiner::Model Refiner::through(const Node& a, const Node& b, const Node& c) noexcept {
  const auto row = [&](const Node& x) {
    struct Row {
      double df;
      std::complex<double> dfh;
      std::complex<double> dh;
    };
    return Row{x.frequency_hz - a.frequency_hz,
               x.frequency_hz * x.response - a.frequency_hz * a.response, x.response - a.response};
  };
  const auto p = row(b);
  const auto q = row(c);
  // β df − γ dfh = dh
  const std::complex<double> determinant = -p.df * q.dfh + q.df * p.dfh;
  const double size = std::abs(p.df * q.dfh) + std::abs(q.df * p.dfh);
  Model model;
  if (!(std::abs(determinant) > 1e-12 * size)) {
    model.beta = p.dh / p.df;  // a straight line
  } else {
    model.gamma = (p.df * q.dh - q.df * p.dh) / determinant;
    model.beta = (p.dh + model.gamma * p.dfh) / p.df;
  }
  model.alpha = a.response * (1.0 + model.gamma * a.frequency_hz) - model.beta * a.frequency_hz;
  model.valid = std::isfinite(std::norm(model.alpha)) && std::isfinite(std::norm(model.beta));
  return model;
}

Refiner::Refiner(const Refinement& refinement, double rate_hz, std::size_t max_points,
                 std::size_t responses)
    : refinement_{refinement},
      used_(refinement.candidates.size()),
      responses_{responses},
      frequencies_(max_points),
      values_(max_points * responses),
      gaps_(max_points) {
  for (const Dwell& dwell : refinement.candidates) {
    candidates_hz_.push_back(dwell.frequency_hz(rate_hz));
  }
}

void Refiner::add(double frequency_hz) noexcept {
  adding_ = false;
  if (count_ == frequencies_.size()) return;
  std::size_t at = 0;
  while (at < count_ && frequencies_[at] < frequency_hz) ++at;
  if (at < count_ && frequencies_[at] == frequency_hz) return;
  const auto move_up = [&](auto begin) {
    std::move_backward(begin + static_cast<std::ptrdiff_t>(at),
                       begin + static_cast<std::ptrdiff_t>(count_),
                       begin + static_cast<std::ptrdiff_t>(count_ + 1));
  };
  move_up(frequencies_.begin());
  move_up(gaps_.begin());
  for (std::size_t response = 0; response < responses_; ++response) {
    move_up(values_.begin() + static_cast<std::ptrdiff_t>(response * frequencies_.size()));
    value(response, at) = {};
  }
  frequencies_[at] = frequency_hz;
  newest_ = at;
  ++count_;
  adding_ = true;
}

void Refiner::set(std::size_t response, std::complex<double> value, double variance) noexcept {
  if (!adding_) return;
  this->value(response, newest_) = {
      .response = value,
      .variance = variance,
      .known = std::isfinite(std::norm(value)) && variance >= 0.0 && std::isfinite(variance)};
}

void Refiner::learn() noexcept {
  if (!std::exchange(adding_, false)) return;
  const std::size_t first = newest_ >= 2 ? newest_ - 2 : 0;
  for (std::size_t gap = first; gap <= newest_ + 1 && gap + 1 < count_; ++gap) look(gap);
}

void Refiner::look(std::size_t gap) noexcept {
  gaps_[gap] = {};
  if (count_ < 4) return;
  for (std::size_t response = 0; response < responses_; ++response) {
    look(response, gap, gaps_[gap]);
  }
}

void Refiner::look(std::size_t response, std::size_t gap, Gap& worst) noexcept {
  // At an end of the sweep the second model goes through the next point but one.
  const bool at_start = gap == 0;
  const bool at_end = gap + 2 == count_;
  const std::array<std::size_t, 4> at{at_start ? 3 : gap - 1, gap, gap + 1,
                                      at_end ? gap - 2 : gap + 2};
  Nodes nodes;
  std::array<double, 4> noise{};
  for (std::size_t i = 0; i < at.size(); ++i) {
    const Value& here = value(response, at[i]);
    if (!here.known) return;
    nodes[i] = {.frequency_hz = frequencies_[at[i]], .response = here.response};
    noise[i] = std::sqrt(here.variance);
  }
  const Model before = through(nodes[0], nodes[1], nodes[2]);
  const Model behind = through(nodes[1], nodes[2], nodes[3]);
  if (!before.valid || !behind.valid) return;

  // The models with each point moved by its noise, in both components.
  struct Moved {
    Model before;
    Model behind;
  };
  std::array<Moved, 8> moved;
  for (std::size_t i = 0; i < moved.size(); ++i) {
    Nodes changed = nodes;
    changed[i / 2].response += i % 2 == 0 ? std::complex<double>{noise[i / 2], 0.0}
                                          : std::complex<double>{0.0, noise[i / 2]};
    moved[i] = {.before = through(changed[0], changed[1], changed[2]),
                .behind = through(changed[1], changed[2], changed[3])};
  }

  const double low = nodes[1].frequency_hz;
  const double high = nodes[2].frequency_hz;
  const auto compare = [&](double frequency_hz) {
    if (!(frequency_hz > low && frequency_hz < high)) return;
    const std::complex<double> a = before.at(frequency_hz);
    const std::complex<double> b = behind.at(frequency_hz);
    double variance = 0.0;
    for (const Moved& each : moved) {
      variance += std::norm(each.before.at(frequency_hz) - each.behind.at(frequency_hz) - (a - b));
    }
    const double difference = std::abs(a - b);
    const double smallest = std::min(std::abs(a), std::abs(b));
    if (!(difference > noise_factor * std::sqrt(variance)) || smallest == 0.0) return;
    const double disagreement_db = db_per_relative * std::log1p(difference / smallest);
    if (!(disagreement_db > worst.disagreement_db)) return;
    worst = {.disagreement_db = disagreement_db, .at_hz = frequency_hz};
  };
  for (int i = 1; i <= looks; ++i) {
    compare(low * std::pow(high / low, static_cast<double>(i) / (looks + 1)));
  }
  compare(before.pole_hz());
  compare(behind.pole_hz());
}

std::optional<std::size_t> Refiner::next() noexcept {
  for (;;) {
    std::size_t widest = 0;
    double most_db = refinement_.tolerance_db;
    for (std::size_t gap = 0; gap + 1 < count_; ++gap) {
      if (gaps_[gap].disagreement_db <= most_db) continue;
      most_db = gaps_[gap].disagreement_db;
      widest = gap;
    }
    if (most_db <= refinement_.tolerance_db) return std::nullopt;
    const double wanted_hz = gaps_[widest].at_hz;
    std::optional<std::size_t> nearest;
    double distance = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < candidates_hz_.size(); ++i) {
      const double frequency_hz = candidates_hz_[i];
      if (used_[i] || frequency_hz <= frequencies_[widest] ||
          frequency_hz >= frequencies_[widest + 1]) {
        continue;
      }
      if (std::abs(frequency_hz - wanted_hz) >= distance) continue;
      distance = std::abs(frequency_hz - wanted_hz);
      nearest = i;
    }
    if (nearest) {
      used_[*nearest] = true;
      return nearest;
    }
    gaps_[widest].disagreement_db = 0.0;
  }
}

double Refiner::worst_db() const noexcept {
  double worst = 0.0;
  for (std::size_t gap = 0; gap + 1 < count_; ++gap) {
    worst = std::max(worst, gaps_[gap].disagreement_db);
  }
  return worst;
}

}  // namespace sinerig
