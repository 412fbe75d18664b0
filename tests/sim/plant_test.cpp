// The simulated plant against Eigen's matrix exponential, and its friction against mechanics.
#include "sim/plant.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <unsupported/Eigen/MatrixFunctions>

#include <gtest/gtest.h>

#include "support/parameters.h"

namespace sinerig::sim {
namespace {

constexpr double period_s = 1e-3;

struct RandomSystem {
  Eigen::MatrixXd a;
  Eigen::VectorXd b;

  LinearSystem with_states_out() const {
    const Eigen::Index n = a.rows();
    return from_state_space(a, b, Eigen::MatrixXd::Identity(n, n), Eigen::VectorXd::Zero(n),
                            std::vector<std::string>(static_cast<std::size_t>(n), "x"));
  }

  // The states `seconds` after a step of `input` from `start`.
  Eigen::VectorXd after(double seconds, double input, const Eigen::VectorXd& start) const {
    const Eigen::Index n = a.rows();
    Eigen::MatrixXd augmented = Eigen::MatrixXd::Zero(n + 1, n + 1);
    augmented.topLeftCorner(n, n) = a * seconds;
    augmented.topRightCorner(n, 1) = b * seconds;
    const Eigen::MatrixXd exponential = augmented.exp();
    return exponential.topLeftCorner(n, n) * start + exponential.topRightCorner(n, 1) * input;
  }
};

// Stable, with time constants from a fiftieth of a tick to hundreds of ticks.
RandomSystem random_system(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const auto n = static_cast<Eigen::Index>(1 + random() % 8);
  RandomSystem system{.a = Eigen::MatrixXd(n, n), .b = Eigen::VectorXd(n)};
  const double scale = std::pow(10.0, 1.0 + 2.5 * std::uniform_real_distribution<double>{}(random));
  for (double& value : system.a.reshaped()) value = scale * normal(random);
  for (double& value : system.b.reshaped()) value = scale * normal(random);
  system.a -= 1.2 * system.a.operatorNorm() * Eigen::MatrixXd::Identity(n, n);
  return system;
}

double relative_error(std::span<const double> measured, const Eigen::VectorXd& exact) {
  const Eigen::Map<const Eigen::VectorXd> values{measured.data(), exact.size()};
  return (values - exact).norm() / exact.norm();
}

TEST(Plant, FollowsTheMatrixExponentialAtAnyInstant) {
  std::mt19937_64 random{test::seed(5)};
  std::uniform_real_distribution<double> fraction{0.0, 1.0};
  for (std::uint64_t i = 0; i < test::count(200); ++i) {
    const RandomSystem system = random_system(random);
    Plant plant{system.with_states_out(), period_s};
    Eigen::VectorXd state = Eigen::VectorXd::Zero(system.a.rows());
    std::vector<double> outputs(plant.outputs());
    PlantTime last;
    double input = 0.0;
    for (std::uint64_t tick = 0; tick < 6; ++tick) {
      const PlantTime applied{.tick = tick, .fraction = fraction(random) * 0.5};
      const PlantTime sampled{.tick = tick, .fraction = 0.5 + fraction(random) * 0.5};
      state = system.after((applied - last) * period_s, input, state);
      input = fraction(random) - 0.5;
      state = system.after((sampled - applied) * period_s, input, state);
      last = sampled;
      plant.apply(input, applied);
      plant.sample(sampled, outputs);
      ASSERT_LT(relative_error(outputs, state), 1e-11) << "system " << i << ", tick " << tick;
    }
  }
}

TEST(Plant, FollowsTheMatrixExponentialOverManyEqualTicks) {
  std::mt19937_64 random{test::seed(6)};
  for (std::uint64_t i = 0; i < test::count(50); ++i) {
    const RandomSystem system = random_system(random);
    Plant plant{system.with_states_out(), period_s};
    std::vector<double> outputs(plant.outputs());
    plant.apply(0.7, {});
    for (std::uint64_t tick = 1; tick <= 100; ++tick) plant.sample({.tick = tick}, outputs);
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(system.a.rows());
    ASSERT_LT(relative_error(outputs, system.after(100.0 * period_s, 0.7, zero)), 1e-11);
  }
}

LinearSystem integrator() {
  return from_transfer_function({1.0}, {1.0, 0.0});
}

class DeadTime : public testing::TestWithParam<double> {};

TEST_P(DeadTime, DelaysTheInputToTheFractionOfATick) {
  LinearSystem system = integrator();
  system.dead_time_s = GetParam();
  Plant plant{system, period_s};
  plant.apply(1.0, {});
  double output = 0.0;
  for (std::uint64_t tick = 0; tick < 40; ++tick) {
    const PlantTime now{.tick = tick, .fraction = 0.25};
    plant.sample(now, {&output, 1});
    const double elapsed_s = (static_cast<double>(tick) + 0.25) * period_s;
    ASSERT_NEAR(output, std::max(0.0, elapsed_s - GetParam()), 1e-15) << tick;
  }
}

INSTANTIATE_TEST_SUITE_P(Each, DeadTime,
                         testing::Values(0.0, 1e-3, 1.5e-3, 0.123e-3, 0.03, 3e-3, 0.0299));

TEST(Plant, ForgetsNoCommandWhileMoreAreUnderWayThanTicksOfDeadTime) {
  LinearSystem system = integrator();
  system.dead_time_s = 5e-3;
  Plant plant{system, period_s};
  const auto value_of = [](std::uint64_t half) {
    return half % 3 == 0 ? 1.0 : -0.25;
  };
  double output = 0.0;
  for (std::uint64_t half = 0; half < 200; ++half) {
    const PlantTime now{.tick = half / 2, .fraction = half % 2 == 0 ? 0.0 : 0.5};
    plant.apply(value_of(half), now);
    plant.sample(now, {&output, 1});
  }
  plant.sample({.tick = 100 + 4, .fraction = 0.5}, {&output, 1});
  double wanted = 0.0;
  for (std::uint64_t half = 0; half < 199; ++half) wanted += value_of(half) * period_s / 2.0;
  EXPECT_NEAR(output, wanted, 1e-14);
}

struct Mass {
  static constexpr double inertia = 2.0;
  static constexpr double damping = 0.5;

  static LinearSystem system(double viscous = damping) {
    MechanicalAxis axis;
    axis.inertia = inertia;
    axis.damping = viscous;
    axis.gain = 4.0;
    return from_mechanical_axis(axis);
  }
};

struct Motion {
  double position = 0.0;
  double velocity = 0.0;
};

// `force` in newton; the command is force / gain.
Motion push(Plant& plant, double force, std::uint64_t from, std::uint64_t to) {
  double outputs[2] = {};
  for (std::uint64_t tick = from; tick < to; ++tick) {
    plant.apply(force / 4.0, {.tick = tick});
    plant.sample({.tick = tick + 1}, outputs);
  }
  return {.position = outputs[0], .velocity = outputs[1]};
}

constexpr Friction friction{.coulomb = 1.0, .breakaway = 1.5, .stribeck_velocity = 0.05};

TEST(FrictionLevel, FallsFromBreakAwayToCoulombWithTheVelocity) {
  EXPECT_DOUBLE_EQ(friction.level(0.0), 1.5);
  EXPECT_DOUBLE_EQ(friction.level(0.05), 1.0 + 0.5 / std::exp(1.0));
  EXPECT_DOUBLE_EQ(friction.level(-0.05), friction.level(0.05));
  EXPECT_NEAR(friction.level(1.0), 1.0, 1e-12);
  EXPECT_EQ((Friction{.coulomb = 1.0}.level(0.0)), 1.0);
  EXPECT_FALSE(Friction{}.present());
}

TEST(Friction, HoldsTheMassBelowTheBreakAwayForce) {
  Plant plant{Mass::system(), period_s, friction};
  const Motion motion = push(plant, 1.49, 0, 5000);
  EXPECT_NEAR(motion.position, 0.0, 1e-12);
  EXPECT_NEAR(motion.velocity, 0.0, 1e-12);
}

TEST(Friction, LetsTheMassSlipAtTheForceThatIsLeft) {
  Plant plant{Mass::system(), period_s, friction};
  const Motion motion = push(plant, 3.0, 0, 40'000);  // ten time constants of 4 s
  EXPECT_NEAR(motion.velocity, (3.0 - friction.coulomb) / Mass::damping, 1e-3);
}

TEST(Friction, ActsAgainstTheMotionInBothDirections) {
  Plant forward{Mass::system(), period_s, friction};
  Plant backward{Mass::system(), period_s, friction};
  const Motion ahead = push(forward, 3.0, 0, 2000);
  const Motion astern = push(backward, -3.0, 0, 2000);
  EXPECT_NEAR(ahead.velocity, -astern.velocity, 1e-12);
  EXPECT_NEAR(ahead.position, -astern.position, 1e-12);
}

TEST(Friction, OfStribeckKeepsAMassSlippingThatItWouldNotLetGo) {
  Plant resting{Mass::system(), period_s, friction};
  Plant moving{Mass::system(), period_s, friction};
  const Motion rests = push(resting, 1.3, 0, 20'000);
  EXPECT_NEAR(rests.velocity, 0.0, 1e-12);
  push(moving, 3.0, 0, 1000);
  const Motion slips = push(moving, 1.3, 1000, 41'000);
  EXPECT_NEAR(slips.velocity, (1.3 - friction.level(slips.velocity)) / Mass::damping, 1e-3);
  EXPECT_GT(slips.velocity, 0.5);
}

TEST(Friction, BringsASlidingMassToRestAfterTheDistanceOfItsEnergy) {
  constexpr double coulomb = 1.0;
  Plant plant{Mass::system(0.0), period_s, {.coulomb = coulomb}};
  const Motion pushed = push(plant, 5.0, 0, 1000);
  const double distance = Mass::inertia * pushed.velocity * pushed.velocity / (2.0 * coulomb);
  const double seconds = Mass::inertia * pushed.velocity / coulomb;
  const auto stop = 1000 + static_cast<std::uint64_t>(seconds * 1000.0) + 10;
  const Motion stopped = push(plant, 0.0, 1000, stop);
  EXPECT_NEAR(stopped.velocity, 0.0, 1e-12);
  EXPECT_NEAR(stopped.position - pushed.position, distance, 1e-3 * distance);
  EXPECT_EQ(push(plant, 0.0, stop, stop + 5000).position, stopped.position);
}

// Behind the lag of its drive: friction is at the mass, at once, in closed form.
TEST(Friction, DoesNotPassThroughTheLagOfTheDrive) {
  constexpr double inertia = 0.01;
  constexpr double gain = 4.0;
  constexpr double coulomb = 0.5;
  constexpr double lag_hz = 10.0;
  constexpr double push_s = 0.1;  // with a force of 1
  const double corner = 2.0 * std::numbers::pi * lag_hz;
  const double slips_s = std::log(2.0) / corner;  // the force has come to that of friction
  const auto pushed = [&](double t) {
    const double impulse =
        (t - slips_s) - (std::exp(-corner * slips_s) - std::exp(-corner * t)) / corner;
    return (impulse - coulomb * (t - slips_s)) / inertia;
  };
  const auto let_go = [&](double t) {
    const double force = 1.0 - std::exp(-corner * push_s);
    const double impulse = force * (1.0 - std::exp(-corner * t)) / corner;
    return pushed(push_s) + (impulse - coulomb * t) / inertia;
  };
  Plant plant{
      from_mechanical_axis({.inertia = inertia, .gain = gain, .modes = {}, .lag_hz = lag_hz}),
      period_s,
      {.coulomb = coulomb}};
  double peak = 0.0;
  for (std::uint64_t tick = 1; tick <= 150; ++tick) {
    const double t = static_cast<double>(tick) * period_s;
    const double velocity = push(plant, t <= push_s ? 1.0 : 0.0, tick - 1, tick).velocity;
    const double exact = t <= slips_s ? 0.0 : t <= push_s ? pushed(t) : let_go(t - push_s);
    ASSERT_NEAR(velocity, exact, 1e-3) << t << " s";
    peak = std::max(peak, velocity);
  }
  EXPECT_NEAR(peak, 3.90, 0.01);
  const Motion stopped = push(plant, 0.0, 150, 400);
  EXPECT_NEAR(stopped.velocity, 0.0, 1e-12);
  EXPECT_NEAR(push(plant, 0.0, 400, 1000).position, stopped.position, 1e-12);
}

TEST(Friction, NeedsAPlantWithAVelocity) {
  try {
    const Plant plant{integrator(), period_s, friction};
    FAIL();
  } catch (const std::invalid_argument& refused) {
    EXPECT_STREQ(refused.what(), "friction needs a plant with a velocity: give a mechanical axis");
  }
}

std::string refusal_of(LinearSystem (*build)()) {
  try {
    build();
  } catch (const std::invalid_argument& refused) {
    return refused.what();
  }
  return "";
}

TEST(LinearSystem, RefusesWhatIsNoProperSystem) {
  EXPECT_EQ(refusal_of([] {
              return from_transfer_function({1.0}, {0.0, 0.0});
            }),
            "the denominator must not be zero");
  EXPECT_EQ(refusal_of([] {
              return from_transfer_function({1.0, 0.0}, {1.0});
            }),
            "the numerator has a higher order than the denominator");
  EXPECT_EQ(refusal_of([] {
              return from_zeros_poles({-1.0, -2.0}, {-3.0}, 1.0);
            }),
            "there are more zeros than poles");
  EXPECT_EQ(refusal_of([] { return from_mechanical_axis({.inertia = 0.0, .modes = {}}); }),
            "the inertia must be above 0");
  EXPECT_EQ(refusal_of([] {
              return from_state_space(Eigen::MatrixXd::Zero(2, 2), Eigen::VectorXd::Zero(3),
                                      Eigen::MatrixXd::Zero(1, 2), Eigen::VectorXd::Zero(1), {"y"});
            }),
            "the matrices do not fit: A is n×n, B n, C outputs×n, D one number per output, and "
            "every output has a name");
}

}  // namespace
}  // namespace sinerig::sim
