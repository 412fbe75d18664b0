// The decoding of edges: counts, time stamps, what is illegal and what was lost.
#include "drivers/gpio/encoder.h"

#include <cmath>
#include <functional>
#include <random>

#include <gmock/gmock.h>

#include "fake_lines.h"
#include "sim/gpio_axis/axis.h"

namespace sinerig::gpio {
namespace {

using testing::HasSubstr;

class HandClock final : public Clock {
 public:
  HandClock() : Clock{TickGrid{1000.0}} {}
  Tick wait() noexcept override { return {}; }
  Instant now() const noexcept override { return {.tick = 0, .offset_ns = now_ns}; }
  std::int64_t time_ns(Instant instant) const noexcept override { return instant.offset_ns; }
  std::int64_t now_ns = 0;
};

struct Bench {
  explicit Bench(const EncoderSettings& settings) : encoder{bank.edges({}), settings, clock} {}

  Sample read_at(std::int64_t time_ns) {
    clock.now_ns = time_ns;
    return encoder.read();
  }

  test::FakeLines lines;
  test::FakeBank bank{lines};
  HandClock clock;
  Encoder encoder;
};

constexpr EncoderSettings plain{.scale = 0.5, .lag_ns = 0};

TEST(Quadrature, CountsEveryWalkAndNeverCallsItIllegal) {
  std::mt19937 random{7};
  Bench bench{plain};
  std::int64_t count = 0;
  for (int n = 1; n < 20'000; ++n) {
    count += random() % 2 == 0 ? 1 : -1;
    bench.lines.show_count(count, n);
    if (n % 7 != 0) continue;
    const Sample sample = bench.read_at(n);
    ASSERT_EQ(sample.value, 0.5 * static_cast<double>(count));
    ASSERT_EQ(sample.fault, Fault::none);
    ASSERT_EQ(sample.time_ns, n);
  }
  EXPECT_EQ(bench.encoder.illegal(), 0U);
  EXPECT_EQ(bench.encoder.lost(), 0U);
}

TEST(Quadrature, BeginsWhereTheLinesStand) {
  test::FakeLines lines;
  lines.levels = 3;
  HandClock clock;
  Encoder encoder{test::FakeBank{lines}.edges({}), plain, clock};
  clock.now_ns = 10;
  lines.edge(0, 5);  // 11 → 01: up
  EXPECT_EQ(encoder.read().value, 0.5);
}

TEST(Quadrature, CallsAnEdgeToTheLevelThatIsThereIllegal) {
  Bench bench{plain};
  bench.lines.show_count(1, 1);
  bench.lines.queue.push_back({2, ++bench.lines.sequence, 0, true});
  const Sample spoiled = bench.read_at(3);
  EXPECT_EQ(spoiled.fault, Fault::bus);
  EXPECT_EQ(spoiled.value, 0.5);
  EXPECT_EQ(bench.encoder.illegal(), 1U);
  EXPECT_EQ(bench.read_at(4).fault, Fault::none) << "one is forgiven";
}

TEST(Quadrature, CountsWhatTheQueueLost) {
  Bench bench{plain};
  bench.lines.show_count(1, 1);
  bench.lines.edge(1, 2, false);
  bench.lines.edge(1, 3, false);
  bench.lines.edge(1, 4, false);
  bench.lines.edge(1, 5);
  EXPECT_EQ(bench.read_at(6).fault, Fault::bus);
  EXPECT_EQ(bench.encoder.lost(), 3U);
  EXPECT_EQ(bench.read_at(7).fault, Fault::none);
}

TEST(Quadrature, IsNoLongerBelievedAfterTooManyErrors) {
  EncoderSettings settings = plain;
  settings.max_errors = 2;
  Bench bench{settings};
  for (int n = 1; n <= 3; ++n) {
    EXPECT_EQ(bench.encoder.reason(), "");
    bench.lines.queue.push_back({n, ++bench.lines.sequence, 0, false});
    EXPECT_EQ(bench.read_at(n).fault, Fault::bus);
  }
  EXPECT_EQ(bench.read_at(9).fault, Fault::bus);
  EXPECT_THAT(bench.encoder.reason(),
              HasSubstr("3 illegal transitions and 0 lost edges (errors_max = 2)"));
}

// While a device is armed again nobody reads, and the kernel keeps the newest 1024 edges.
TEST(Quadrature, IsBelievedAgainAfterCatchingUp) {
  Bench bench{plain};
  for (int n = 1; n <= 3000; ++n)
    bench.lines.edge(static_cast<std::uint8_t>(n % 2), n, n > 3000 - 1024);
  bench.clock.now_ns = 3001;
  bench.encoder.catch_up();
  EXPECT_EQ(bench.encoder.lost(), 3000U - 1024U);
  EXPECT_EQ(bench.encoder.reason(), "");
  EXPECT_EQ(bench.read_at(3002).fault, Fault::none);
  bench.lines.edge(1, 3003);
  EXPECT_EQ(bench.read_at(3004).fault, Fault::none);

  bench.lines.refuse = true;
  EXPECT_THROW(bench.encoder.catch_up(), std::runtime_error);
}

TEST(Quadrature, SortsEdgesThatChangedPlacesInTheKernel) {
  Bench bench{plain};
  bench.lines.show_count(1, 10);
  bench.lines.show_count(2, 20);
  std::swap(bench.lines.queue[0], bench.lines.queue[1]);
  EXPECT_EQ(bench.read_at(30).value, 1.0);
  EXPECT_EQ(bench.encoder.illegal() + bench.encoder.lost(), 0U);
}

TEST(Lag, WaitsForEdgesThatAreStillOnTheirWay) {
  EncoderSettings settings = plain;
  settings.lag_ns = 100;
  Bench bench{settings};
  bench.lines.show_count(1, 350);
  bench.lines.show_count(2, 420);
  const Sample sample = bench.read_at(500);
  EXPECT_EQ(sample.time_ns, 400);
  EXPECT_EQ(sample.value, 0.5) << "the second edge is younger than the sample";
  EXPECT_EQ(bench.read_at(600).value, 1.0);
  EXPECT_EQ(bench.encoder.late(), 0U);
  bench.lines.show_count(3, 480);
  bench.read_at(700);
  EXPECT_EQ(bench.encoder.late(), 1U);
}

TEST(Lag, ThatIsTooShortIsToldWithOneThatIsNot) {
  EncoderSettings settings = plain;
  settings.lag_ns = 100'000;
  Bench bench{settings};
  bench.read_at(1'000'000);
  EXPECT_FALSE(bench.encoder.doubtful());
  EXPECT_EQ(bench.encoder.seen(), "0 illegal transitions, 0 lost edges");
  bench.lines.show_count(1, 600'000);
  bench.read_at(2'000'000);
  EXPECT_TRUE(bench.encoder.doubtful());
  EXPECT_THAT(bench.encoder.seen(),
              HasSubstr("1 edges later than lag_s = 0.0001 by up to 0.0003 s"));
  EXPECT_THAT(bench.encoder.seen(), HasSubstr("lag_s = 0.0006 has room for them"));
}

TEST(EdgeSamples, AreStaleWithoutAnEdge) {
  EncoderSettings settings = plain;
  settings.samples = EncoderSettings::Samples::edge;
  Bench bench{settings};
  EXPECT_EQ(bench.read_at(1).fault, Fault::stale);
  bench.lines.show_count(1, 5);
  const Sample sample = bench.read_at(9);
  EXPECT_EQ(sample.fault, Fault::none);
  EXPECT_EQ(sample.time_ns, 5);
  EXPECT_EQ(sample.value, 0.25) << "the border between the counts 0 and 1";
  EXPECT_EQ(bench.read_at(10).fault, Fault::stale);
}

TEST(Lines, ThatCannotBeReadAreABusFault) {
  Bench bench{plain};
  bench.lines.refuse = true;
  EXPECT_EQ(bench.read_at(1).fault, Fault::bus);
  EXPECT_THAT(bench.encoder.reason(), HasSubstr("no longer be read"));
  bench.lines.refuse = false;
  EXPECT_EQ(bench.read_at(2).fault, Fault::none);
}

// An axis that swings by itself, in closed form: every sample against where it really is.
TEST(Samples, AreWhereTheShaftWasAtTheirTime) {
  sim::MechanicalAxis mechanics;
  mechanics.inertia = 0.02;
  mechanics.damping = 0.05;
  mechanics.stiffness = 30.0;
  const sim::LinearSystem system = sim::from_mechanical_axis(mechanics);
  constexpr double per_count = 4e-4;
  // A step of torque 3: x = 0.1 (1 − e^(−at) (cos wt + a/w sin wt)).
  const double a = 0.05 / (2 * 0.02);
  const double w = std::sqrt(30.0 / 0.02 - a * a);
  const auto position = [&](std::int64_t time_ns) {
    const double t = static_cast<double>(time_ns) * 1e-9;
    return 0.1 * (1.0 - std::exp(-a * t) * (std::cos(w * t) + a / w * std::sin(w * t)));
  };
  for (const bool edges : {false, true}) {
    EncoderSettings settings{.scale = per_count};
    if (edges) settings.samples = EncoderSettings::Samples::edge;
    Bench bench{settings};
    sim::Axis axis{system, 0, per_count, 0};
    axis.apply(3.0, 0);
    double worst = 0.0;
    int good = 0;
    for (std::int64_t now_ns = 1'000'000; now_ns < 1'000'000'000; now_ns += 1'000'000) {
      while (const auto crossing = axis.next(now_ns)) {
        axis.take(*crossing);
        bench.lines.show_count(axis.count(), crossing->time_ns);
      }
      const Sample sample = bench.read_at(now_ns);
      if (sample.fault != Fault::none) continue;
      ++good;
      worst = std::max(worst, std::abs(sample.value - position(sample.time_ns)));
    }
    // The fastest is 3.5 rad/s: 1 ns is 3.5e-9 rad.
    EXPECT_LT(worst, edges ? 1e-8 : per_count / 2 + 1e-8);
    EXPECT_GT(good, edges ? 800 : 998);
    EXPECT_EQ(bench.encoder.illegal() + bench.encoder.lost() + bench.encoder.late(), 0U);
  }
}

}  // namespace
}  // namespace sinerig::gpio
