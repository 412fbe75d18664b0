// The mechanics of the simulated drives on a bus: every set-point acts for its own time, however
// fast they come, however long the dead time, whoever looks.
#include "sim/motor.h"

#include <random>
#include <string>

#include <gtest/gtest.h>

#include "sim/gpio_axis/axis.h"
#include "support/parameters.h"

namespace sinerig::sim {
namespace {

constexpr std::int64_t start_ns = 123'456'789;
constexpr double inertia = 0.02;

struct Traffic {
  double dead_time_s;
  std::int64_t interval_ns;  // of the set-points
  int looked_at_every;       // so many set-points; 0 = never before the end
};

LinearSystem mass(double dead_time_s) {
  LinearSystem system = from_mechanical_axis({.inertia = inertia, .modes = {}});
  system.dead_time_s = dead_time_s;
  return system;
}

class SetPoints : public testing::TestWithParam<Traffic> {
 protected:
  static constexpr int count = 400;

  // Sends them; after the last has acted for its time the mass has the momentum of all of them.
  template <class Apply, class Velocity>
  void expect_momentum(const Apply& apply, const Velocity& velocity_at) const {
    std::mt19937_64 random{test::seed(11)};
    std::uniform_real_distribution<double> torque{-1.0, 1.0};
    const Traffic& traffic = GetParam();
    double momentum = 0.0;
    std::int64_t now_ns = start_ns;
    for (int n = 1; n <= count; ++n) {
      const double value = torque(random);
      apply(value, now_ns);
      momentum += value * static_cast<double>(traffic.interval_ns) * 1e-9;
      if (traffic.looked_at_every > 0 && n % traffic.looked_at_every == 0) velocity_at(now_ns);
      now_ns += traffic.interval_ns;
    }
    apply(0.0, now_ns);
    const auto dead_ns = static_cast<std::int64_t>(traffic.dead_time_s * 1e9 + 0.5);
    EXPECT_NEAR(velocity_at(now_ns + dead_ns), momentum / inertia, 1e-12);
    EXPECT_NEAR(velocity_at(now_ns + 10 * dead_ns), momentum / inertia, 1e-12);
  }
};

TEST_P(SetPoints, ToAMotorAllActForTheirTime) {
  Motor motor{mass(GetParam().dead_time_s), start_ns};
  expect_momentum([&](double torque, std::int64_t now_ns) { motor.apply(torque, now_ns); },
                  [&](std::int64_t now_ns) {
                    motor.sample(now_ns);
                    return motor.velocity();
                  });
}

TEST_P(SetPoints, ToAnAxisWithAnEncoderAllActForTheirTime) {
  constexpr std::size_t velocity = 1;
  Axis axis{mass(GetParam().dead_time_s), velocity, 1e6, start_ns};
  expect_momentum([&](double torque, std::int64_t now_ns) { axis.apply(torque, now_ns); },
                  [&](std::int64_t now_ns) { return axis.position(now_ns); });
}

std::string name_of(const testing::TestParamInfo<Traffic>& traffic) {
  return "Every" + std::to_string(traffic.param.interval_ns / 1000) + "usAfter" +
         std::to_string(static_cast<int>(traffic.param.dead_time_s * 1e6)) + "usLookedAtEvery" +
         std::to_string(traffic.param.looked_at_every);
}

INSTANTIATE_TEST_SUITE_P(Each, SetPoints,
                         testing::Values(Traffic{0.0, 1'000'000, 1}, Traffic{0.0, 1'000'000, 0},
                                         Traffic{0.0, 100'000, 40}, Traffic{0.02, 500'000, 1},
                                         Traffic{0.02, 500'000, 0}, Traffic{0.02, 70'000, 20},
                                         Traffic{0.0033, 1'000'000, 0}),
                         name_of);

}  // namespace
}  // namespace sinerig::sim
