// Exact simulation of a linear plant under a zero-order hold: the state is carried from edge to
// edge of the input by the matrix exponential, so that fractional dead time, sub-tick sampling and
// late commands are all exact. No allocation after construction.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/linear_system.h"

namespace sinerig::sim {

// A time as whole ticks and a fraction of one, 0 <= fraction < 1.
struct PlantTime {
  std::uint64_t tick = 0;
  double fraction = 0.0;

  // In ticks, exact while the two are close.
  friend double operator-(const PlantTime& a, const PlantTime& b) noexcept {
    const auto whole = static_cast<double>(static_cast<std::int64_t>(a.tick - b.tick));
    return whole + (a.fraction - b.fraction);
  }
  PlantTime plus(double ticks) const noexcept {
    const double sum = fraction + ticks;
    auto whole = static_cast<std::int64_t>(sum);
    if (static_cast<double>(whole) > sum) --whole;
    return {.tick = tick + static_cast<std::uint64_t>(whole),
            .fraction = sum - static_cast<double>(whole)};
  }
};

// Force against motion: Coulomb level, and a Stribeck rise to the break-away level at rest.
struct Friction {
  double coulomb = 0.0;             // unit of force
  double breakaway = 0.0;           // at rest; 0 = the Coulomb level
  double stribeck_velocity = 0.01;  // the rise has fallen to 1/e at this velocity

  bool present() const noexcept { return coulomb > 0.0 || breakaway > 0.0; }
  double level(double velocity) const noexcept;
};

class Plant {
 public:
  // Throws std::invalid_argument where friction is asked of a plant without a velocity.
  Plant(const LinearSystem& system, double period_s, Friction friction = {});

  // The input becomes `value` at `time` (plus the dead time); times must not go back. Room is for
  // the commands of the dead time at one per tick, and some.
  void apply(double value, PlantTime time) noexcept;

  // Room for one more input under way. Allocates: for whoever is commanded faster than once a tick,
  // outside the loop.
  void make_room();

  // Carries the state to `time`, which must not go back, and writes every output.
  void sample(PlantTime time, std::span<double> outputs) noexcept;

  std::size_t outputs() const noexcept { return outputs_; }
  PlantTime time() const noexcept { return now_; }  // of the last sample

 private:
  struct Edge {
    PlantTime time;
    double value = 0.0;
  };
  struct Transition {
    double ticks = 0.0;
    std::vector<double> phi;    // n columns of rows_, zeros below
    std::vector<double> gamma;  // rows_
    std::vector<double> force;  // likewise, of a unit force; empty without friction
  };

  std::size_t wrapped(std::size_t index) const noexcept {
    return index < edges_.size() ? index : index - edges_.size();
  }
  void drop_first_edge() noexcept {
    first_edge_ = wrapped(first_edge_ + 1);
    --edge_count_;
  }
  void advance(double ticks) noexcept;
  void step(double ticks, const Transition* known) noexcept;
  void step_with_friction(double ticks) noexcept;
  const Transition* transition(double ticks) noexcept;
  void learn(Transition& slot, double ticks) noexcept;
  void integrate(std::span<double> state, const std::vector<double>& column, double input,
                 double ticks) noexcept;

  std::size_t n_;
  std::size_t outputs_;
  double dead_ticks_;
  std::vector<double> a_;  // per tick, row-major
  std::vector<double> b_;
  std::vector<double> force_;  // b of the force at the velocity
  std::vector<double> c_;
  std::vector<double> d_;
  std::vector<double> velocity_;
  Friction friction_;
  double norm_;  // of A per tick, with b

  std::size_t rows_;  // n_ rounded up
  std::vector<double> state_;
  std::vector<double> scratch_;
  std::vector<double> term_;
  std::vector<double> product_;
  std::vector<double> pushed_;
  PlantTime now_;
  double input_ = 0.0;

  std::vector<Edge> edges_;  // ring of inputs still under way
  std::size_t first_edge_ = 0;
  std::size_t edge_count_ = 0;

  std::vector<Transition> known_;
  std::size_t known_count_ = 0;
  std::array<double, 16> missed_{};  // ring of lengths met lately
  std::size_t next_missed_ = 0;
};

}  // namespace sinerig::sim
