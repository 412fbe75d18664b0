// What the outputs are, tick by tick, and that their mean follows the command.
#include "drivers/gpio/modulator.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <gmock/gmock.h>

namespace sinerig::gpio {
namespace {

using testing::ElementsAre;

std::vector<std::uint32_t> levels(Modulator& modulator, double command, int ticks) {
  std::vector<std::uint32_t> seen;
  for (int n = 0; n < ticks; ++n) seen.push_back(modulator.next(command).levels);
  return seen;
}

TEST(Density, OfAQuarterIsEveryFourthTick) {
  DensityModulator output{{.low = 0.0, .high = 8.0}};
  EXPECT_THAT(levels(output, 2.0, 8), ElementsAre(0, 0, 1, 0, 0, 0, 1, 0));
}

// First order: what is owed never exceeds half a level, so the mean over n ticks is right to 1/n.
TEST(Density, NeverOwesMoreThanHalfALevel) {
  DensityModulator output{{.low = -1.0, .high = 3.0}};
  double owed = 0.0;
  for (int n = 0; n < 20'000; ++n) {
    const double command = 1.0 + 1.9 * std::sin(0.0371 * n);
    const Drive drive = output.next(command);
    EXPECT_EQ(drive.applied, drive.levels == 1 ? 3.0 : -1.0);
    owed += command - drive.applied;
    ASSERT_LE(std::abs(owed), 2.0 + 1e-9) << n;
  }
}

TEST(Density, WithDitherOwesMoreButStillABoundedSum) {
  DensityModulator output{{.low = -1.0, .high = 3.0, .dither = 0.5}};
  double owed = 0.0;
  double most = 0.0;
  for (int n = 0; n < 20'000; ++n) {
    const double command = 1.0 + 1.4 * std::sin(0.0371 * n);
    owed += command - output.next(command).applied;
    most = std::max(most, std::abs(owed));
  }
  EXPECT_LE(most, 4.0 * (0.5 + 0.25) + 1e-9);
  EXPECT_GT(most, 2.1) << "it is there";
}

TEST(SignMagnitude, WithDitherIsNotTheSameInEveryCycle) {
  for (const double dither : {0.0, 0.5}) {
    SignMagnitudeModulator output{{.full = 1.0, .dither = dither}};
    std::vector<std::vector<std::uint32_t>> cycles(4);
    for (auto& cycle : cycles)
      for (int n = 0; n < 100; ++n)
        cycle.push_back(output.next(0.6 * std::sin(2.0 * std::numbers::pi * n / 100.0)).levels &
                        1U);
    EXPECT_EQ(cycles[2] == cycles[3], dither == 0.0);
  }
}

TEST(Density, HoldsALevelForTheTicksAskedFor) {
  DensityModulator output{{.low = 0.0, .high = 1.0, .hold_ticks = 5}};
  std::uint32_t last = 0;
  int since = 5;
  double sum = 0.0;
  for (int n = 0; n < 10'000; ++n) {
    const Drive drive = output.next(0.3);
    if (drive.levels != last) {
      ASSERT_GE(since, 5) << n;
      since = 0;
    }
    ++since;
    last = drive.levels;
    sum += drive.applied;
  }
  EXPECT_NEAR(sum / 10'000, 0.3, 1e-3);
}

TEST(Density, OfACommandOutsideIsTheNearestLevelAndDoesNotWindUp) {
  DensityModulator output{{.low = 0.0, .high = 1.0}};
  for (int n = 0; n < 1000; ++n) EXPECT_EQ(output.next(7.0).applied, 1.0);
  EXPECT_LE(output.next(0.0).applied + output.next(0.0).applied, 1.0);
}

TEST(Density, WithTheLevelsSwappedFollowsAsWell) {
  DensityModulator output{{.low = 4.0, .high = 0.0}};
  double sum = 0.0;
  for (int n = 0; n < 4000; ++n) sum += output.next(1.0).applied;
  EXPECT_NEAR(sum / 4000, 1.0, 1e-3);
}

TEST(SignMagnitude, HasThreeLevelsAndOwesAtMostHalfOfOne) {
  SignMagnitudeModulator output{{.full = 2.0}};
  double owed = 0.0;
  for (int n = 0; n < 20'000; ++n) {
    const double command = 1.7 * std::sin(0.0123 * n);
    const Drive drive = output.next(command);
    const double meant = (drive.levels & 1U) == 0 ? 0.0 : (drive.levels & 2U) != 0 ? -2.0 : 2.0;
    EXPECT_EQ(drive.applied, meant);
    owed += command - drive.applied;
    ASSERT_LE(std::abs(owed), 1.0 + 1e-9) << n;
  }
}

TEST(SignMagnitude, PausesBeforeAReversalAndTurnsTheDirectionInThePause) {
  for (const std::uint32_t pause : {1U, 2U, 7U}) {
    SignMagnitudeModulator output{{.full = 1.0, .reversal_ticks = pause}};
    bool was_negative = false;
    std::uint32_t off = pause;
    int reversals = 0;
    for (int n = 0; n < 5000; ++n) {
      const Drive drive = output.next(0.9 * std::sin(0.02 * n));
      const bool on = (drive.levels & 1U) != 0;
      const bool negative = (drive.levels & 2U) != 0;
      if (negative != was_negative) {
        EXPECT_FALSE(on) << n;
        ++reversals;
      }
      if (on && reversals > 0) {
        EXPECT_GE(off, off > 0 && negative != was_negative ? pause : 0U) << n;
      }
      off = on ? 0 : off + 1;
      was_negative = negative;
    }
    EXPECT_GE(reversals, 15) << pause;
  }
}

TEST(SignMagnitude, CountsTheTicksOfAPause) {
  SignMagnitudeModulator output{{.full = 1.0, .reversal_ticks = 3}};
  EXPECT_THAT(levels(output, 1.0, 3), ElementsAre(1, 1, 1));
  // What the pause costs is owed, so that the reversal comes when the sum asks for it.
  const auto seen = levels(output, -1.0, 6);
  EXPECT_THAT(seen, ElementsAre(0, 0, 2, 3, 3, 3));
}

TEST(Step, IsATickHighATickLowAndNeverFasterThanAsked) {
  StepModulator output{{.step = 0.1, .min_ticks = 3}};
  EXPECT_THAT(levels(output, 0.35, 12), ElementsAre(1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0));
}

TEST(Step, TurnsTheDirectionATickBeforeItSteps) {
  StepModulator output{{.step = 1.0}};
  EXPECT_THAT(levels(output, -2.0, 6), ElementsAre(2, 3, 2, 3, 2, 2));
}

TEST(Step, SaysWhereTheMotorReallyIs) {
  StepModulator output{{.step = 0.01, .origin = 0.5, .min_ticks = 2}};
  std::int64_t steps = 0;
  bool was_high = false;
  for (int n = 0; n < 20'000; ++n) {
    const double command = 0.5 + 0.2 * std::sin(0.004 * n);
    const Drive drive = output.next(command);
    const bool high = (drive.levels & 1U) != 0;
    ASSERT_FALSE(high && was_high) << n;
    if (high) steps += (drive.levels & 2U) != 0 ? -1 : 1;
    was_high = high;
    ASSERT_DOUBLE_EQ(drive.applied, 0.5 + 0.01 * static_cast<double>(steps));
    ASSERT_LT(std::abs(drive.applied - command), 0.02) << n;
  }
}

TEST(Step, DoesNotChatterBetweenTwoSteps) {
  StepModulator output{{.step = 1.0}};
  output.next(0.5);
  for (int n = 0; n < 100; ++n) EXPECT_EQ(output.next(0.5).levels & 1U, 0U);
}

// A refused pulse is none: what is recorded as applied stays where the motor is.
TEST(Step, IsNotCountedWhereTheLinesRefuseIt) {
  for (int refused = 0; refused < 24; ++refused) {
    StepModulator output{{.step = 1.0, .min_ticks = 2}};
    std::uint32_t held = 0;
    double motor = 0.0;
    for (int n = 0; n < 50; ++n) {
      const Drive drive = output.next(n < 12 ? 5.0 : -1.0);
      if (n == refused || n == refused + 1) {
        output.take_back();
        continue;
      }
      if ((drive.levels & 1U) > (held & 1U)) {
        ASSERT_EQ(drive.levels & 2U, held & 2U) << "the direction has to stand before the step";
        motor += (drive.levels & 2U) != 0 ? -1.0 : 1.0;
      }
      held = drive.levels;
      ASSERT_EQ(drive.applied, motor) << "refused at " << refused << ", tick " << n;
    }
    EXPECT_EQ(motor, -1.0) << refused;
  }
}

TEST(Rest, LeavesTheLineInactive) {
  DensityModulator density{{.low = 0.0, .high = 1.0}};
  SignMagnitudeModulator drive{{.full = 1.0}};
  StepModulator steps{{.step = 1.0}};
  for (Modulator* modulator : {static_cast<Modulator*>(&density), static_cast<Modulator*>(&drive),
                               static_cast<Modulator*>(&steps)}) {
    modulator->next(1.0);
    EXPECT_EQ(modulator->rest().levels & 1U, 0U);
  }
}

}  // namespace
}  // namespace sinerig::gpio
