#include "sim/plant.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>

namespace sinerig::sim {

namespace {

// Friction is resolved this many times per tick; the stick decision is implicit, so this sets the
// resolution of the reversal, not stability.
constexpr double friction_substeps = 16.0;

constexpr std::size_t rows_at_a_time = 4;

constexpr std::size_t max_known_transitions = 32;

// Edges of the input that can be under way at once beside those of the dead time.
constexpr std::size_t spare_edges = 16;

double dot(const double* a, const double* b, std::size_t n) noexcept {
  double sum = 0.0;
  for (std::size_t i = 0; i < n; ++i) sum += a[i] * b[i];
  return sum;
}

std::vector<double> row_major(const Eigen::MatrixXd& matrix) {
  std::vector<double> values;
  values.reserve(static_cast<std::size_t>(matrix.size()));
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) values.push_back(matrix(i, j));
  }
  return values;
}

}  // namespace

double Friction::level(double velocity) const noexcept {
  if (breakaway <= coulomb) return coulomb;
  const double ratio = velocity / stribeck_velocity;
  return coulomb + (breakaway - coulomb) * std::exp(-ratio * ratio);
}

Plant::Plant(const LinearSystem& system, double period_s, Friction friction)
    : n_{static_cast<std::size_t>(system.states())},
      outputs_{static_cast<std::size_t>(system.c.rows())},
      dead_ticks_{system.dead_time_s / period_s},
      a_{row_major(system.a * period_s)},
      b_{row_major(system.b * period_s)},
      force_{row_major(system.force * period_s)},
      c_{row_major(system.c)},
      d_{row_major(system.d)},
      velocity_{row_major(system.velocity)},
      friction_{friction},
      norm_{n_ == 0 ? 0.0 : (system.a * period_s).cwiseAbs().rowwise().sum().maxCoeff()},
      rows_{(n_ + rows_at_a_time - 1) / rows_at_a_time * rows_at_a_time},
      state_(rows_),
      scratch_(rows_),
      term_(n_),
      product_(n_),
      pushed_(rows_),
      edges_(static_cast<std::size_t>(std::ceil(dead_ticks_)) + spare_edges),
      known_(max_known_transitions,
             {.ticks = 0.0,
              .phi = std::vector<double>(n_ * rows_),
              .gamma = std::vector<double>(rows_),
              .force = std::vector<double>(friction.present() ? rows_ : 0)}) {
  // Dead times that are whole ticks but for the rounding of the division are whole ticks.
  if (std::abs(dead_ticks_ - std::round(dead_ticks_)) < 1e-9) dead_ticks_ = std::round(dead_ticks_);
  if (friction_.present() && velocity_.empty()) {
    throw std::invalid_argument("friction needs a plant with a velocity: give a mechanical axis");
  }
}

void Plant::apply(double value, PlantTime time) noexcept {
  const PlantTime due = time.plus(dead_ticks_);
  if (edge_count_ == edges_.size()) {
    // More commands than the dead time can hold at the loop's rate: the oldest takes effect now.
    input_ = edges_[first_edge_].value;
    drop_first_edge();
  }
  edges_[wrapped(first_edge_ + edge_count_)] = {.time = due, .value = value};
  ++edge_count_;
}

void Plant::make_room() {
  if (edge_count_ < edges_.size()) return;
  std::rotate(edges_.begin(), edges_.begin() + static_cast<std::ptrdiff_t>(first_edge_),
              edges_.end());
  first_edge_ = 0;
  edges_.resize(2 * edges_.size());
}

void Plant::sample(PlantTime time, std::span<double> outputs) noexcept {
  while (edge_count_ > 0 && edges_[first_edge_].time - time <= 0.0) {
    const Edge& edge = edges_[first_edge_];
    const double ticks = edge.time - now_;
    if (ticks > 0.0) {
      advance(ticks);
      now_ = edge.time;
    }
    input_ = edge.value;
    drop_first_edge();
  }
  const double ticks = time - now_;
  if (ticks > 0.0) {
    advance(ticks);
    now_ = time;
  }
  for (std::size_t i = 0; i < outputs_; ++i) {
    outputs[i] = dot(c_.data() + i * n_, state_.data(), n_) + d_[i] * input_;
  }
}

void Plant::advance(double ticks) noexcept {
  if (!friction_.present()) {
    step(ticks, transition(ticks));
    return;
  }
  const auto pieces = static_cast<std::int64_t>(std::ceil(ticks * friction_substeps));
  const double substep = ticks / static_cast<double>(pieces);
  for (std::int64_t i = 0; i < pieces; ++i) step_with_friction(substep);
}

void Plant::step(double ticks, const Transition* known) noexcept {
  if (known == nullptr) {
    integrate(state_, b_, input_, ticks);
    return;
  }
  // Rows at a time, whose sums don't wait for each other.
  for (std::size_t i = 0; i < rows_; i += rows_at_a_time) {
    double sums[rows_at_a_time] = {};
    for (std::size_t j = 0; j < n_; ++j) {
      const double* column = known->phi.data() + j * rows_ + i;
      for (std::size_t k = 0; k < rows_at_a_time; ++k) sums[k] += column[k] * state_[j];
    }
    for (std::size_t k = 0; k < rows_at_a_time; ++k) {
      scratch_[i + k] = sums[k] + known->gamma[i + k] * input_;
    }
  }
  state_.swap(scratch_);
}

// Time stepping with the friction force chosen at the end of the step: the force that stops the
// motion if friction can give it, its full level against the motion otherwise. It acts on the
// mechanics, behind a lag of the drive.
void Plant::step_with_friction(double ticks) noexcept {
  const Transition* known = transition(ticks);
  step(ticks, known);
  if (known == nullptr) {
    std::fill(pushed_.begin(), pushed_.end(), 0.0);
    integrate(pushed_, force_, 1.0, ticks);
  }
  const std::vector<double>& pushed = known != nullptr ? known->force : pushed_;
  const double velocity_per_force = dot(velocity_.data(), pushed.data(), n_);
  if (velocity_per_force == 0.0) return;
  const double free_velocity = dot(velocity_.data(), state_.data(), n_);
  const double level = friction_.level(free_velocity);
  const double force = std::clamp(free_velocity / velocity_per_force, -level, level);
  for (std::size_t i = 0; i < n_; ++i) state_[i] -= pushed[i] * force;
}

const Plant::Transition* Plant::transition(double ticks) noexcept {
  for (std::size_t i = 0; i < known_count_; ++i) {
    if (known_[i].ticks == ticks) return &known_[i];
  }
  // A length that comes back soon is worth its matrices; a jittered one never comes back.
  const bool seen = std::find(missed_.begin(), missed_.end(), ticks) != missed_.end();
  if (seen && known_count_ < known_.size()) {
    learn(known_[known_count_], ticks);
    return &known_[known_count_++];
  }
  missed_[next_missed_] = ticks;
  next_missed_ = (next_missed_ + 1) % missed_.size();
  return nullptr;
}

void Plant::learn(Transition& slot, double ticks) noexcept {
  slot.ticks = ticks;
  for (std::size_t j = 0; j <= n_; ++j) {
    std::fill(scratch_.begin(), scratch_.end(), 0.0);
    if (j < n_) scratch_[j] = 1.0;
    integrate(scratch_, b_, j < n_ ? 0.0 : 1.0, ticks);
    std::copy_n(scratch_.begin(), n_, j < n_ ? &slot.phi[j * rows_] : slot.gamma.data());
  }
  if (!friction_.present()) return;
  std::fill(slot.force.begin(), slot.force.end(), 0.0);
  integrate(slot.force, force_, 1.0, ticks);
}

// x(t + h) = x + Σ (A h)^k / k! · (A x + b u) h / (k + 1), b being `column`: the exponential series
// on a vector, in pieces short enough for it to converge to the last bit in some twenty terms.
void Plant::integrate(std::span<double> state, const std::vector<double>& column, double input,
                      double ticks) noexcept {
  const auto pieces = static_cast<std::int64_t>(std::max(1.0, std::ceil(2.0 * norm_ * ticks)));
  const double h = ticks / static_cast<double>(pieces);
  for (std::int64_t piece = 0; piece < pieces; ++piece) {
    for (std::size_t i = 0; i < n_; ++i) {
      term_[i] = (dot(a_.data() + i * n_, state.data(), n_) + column[i] * input) * h;
    }
    for (int k = 2; k < 40; ++k) {
      double largest_term = 0.0;
      double largest_state = 0.0;
      for (std::size_t i = 0; i < n_; ++i) {
        state[i] += term_[i];
        largest_term = std::max(largest_term, std::abs(term_[i]));
        largest_state = std::max(largest_state, std::abs(state[i]));
      }
      if (largest_term <= 1e-18 * largest_state) break;
      for (std::size_t i = 0; i < n_; ++i)
        product_[i] = dot(a_.data() + i * n_, term_.data(), n_) * h / k;
      term_.swap(product_);
    }
  }
}

}  // namespace sinerig::sim
