#include "identify/loop_analysis.h"

#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include "identify/loop_conversions.h"
#include "identify/loop_model.h"
#include "plants.h"

namespace sinerig::identify {
namespace {

using Complex = std::complex<double>;

constexpr double pi = std::numbers::pi;
constexpr double turn = 2.0 * pi;

LogScatter exact(double) {
  return {};
}

LoopFigures figures_of(const ZerosPolesGain& L) {
  return analyse_loop(LoopModel(L, {}).curve(1e-2, 1e2, exact));
}

// 1/(s (s+1)²): arg = −180° at ω = 1 where |L| = 1/2; |L| = 1 where ω + ω³ = 1.
TEST(LoopAnalysis, FindsTheMarginsOfATextbookLoop) {
  const LoopFigures figures = figures_of({{}, {0.0, -1.0, -1.0}, 1.0, 0.0});
  ASSERT_TRUE(figures.gain_margin);
  EXPECT_NEAR(figures.gain_margin->margin_db.value, 20.0 * std::log10(2.0), 1e-9);
  EXPECT_NEAR(figures.gain_margin->frequency_hz.value, 1.0 / turn, 1e-10);
  const double crossover = 0.6823278038280193;
  ASSERT_TRUE(figures.phase_margin);
  EXPECT_NEAR(figures.phase_margin->frequency_hz.value, crossover / turn, 1e-10);
  EXPECT_NEAR(figures.phase_margin->margin_deg.value,
              90.0 - 2.0 * std::atan(crossover) * 180.0 / pi, 1e-8);
  EXPECT_FALSE(figures.gain_reduction);
}

// −0.5/(s + 1): the closed loop has its pole at −0.5 and loses it to the right for twice the gain.
TEST(LoopAnalysis, FindsTheGainMarginAtZeroFrequency) {
  const LoopFigures figures = figures_of({{}, {-1.0}, -0.5, 0.0});
  ASSERT_TRUE(figures.gain_margin);
  EXPECT_NEAR(figures.gain_margin->margin_db.value, 20.0 * std::log10(2.0), 1e-9);
  EXPECT_EQ(figures.gain_margin->frequency_hz.value, 0.0);
  EXPECT_FALSE(figures_of({{}, {-1.0}, 0.5, 0.0}).gain_margin);
  const LoopFigures unstable =
      analyse_loop(LoopModel({{}, {-1.0}, -2.0, 0.0}, {}).curve(1e-2, 1e2, exact), false);
  ASSERT_TRUE(unstable.gain_margin);
  EXPECT_NEAR(unstable.gain_margin->margin_db.value, -20.0 * std::log10(2.0), 1e-9);
}

// K/s in ticks of T is KT/(z − 1): at half the rate −KT/2, and stable up to KT = 2.
TEST(LoopAnalysis, FindsTheGainMarginAtHalfTheRate) {
  const LoopModel loop({{}, {0.0}, 1.0, 0.0}, {{}, {}, 500.0, 0.0}, 1000.0);
  const LoopFigures figures =
      analyse_loop(loop.curve(1.0, loop.highest_rad_s(), exact), loop.closed_loop_stable());
  ASSERT_TRUE(figures.gain_margin);
  EXPECT_NEAR(figures.gain_margin->margin_db.value, 20.0 * std::log10(4.0), 1e-6);
  EXPECT_NEAR(figures.gain_margin->frequency_hz.value, 500.0, 1e-9);
  // Searched to less than that nothing is said of it, but how far the search went.
  const LoopFigures below = analyse_loop(loop.curve(1.0, turn * 400.0, exact), true);
  EXPECT_FALSE(below.gain_margin);
  EXPECT_NEAR(below.searched_to_hz, 400.0, 1e-9);
}

// std::max(0.0, NaN) is 0.0, and a figure with that for its variance looks exactly known.
TEST(LoopAnalysis, KeepsAScatterThatIsNotKnownApartFromNone) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  const LoopModel loop({{}, {0.0, -1.0, -1.0}, 1.0, 0.0}, {});
  const LoopFigures figures = analyse_loop(loop.curve(1e-2, 1e2, [none](double) {
    return LogScatter{none, none, none};
  }));
  EXPECT_TRUE(std::isnan(figures.gain_margin->margin_db.high));
  EXPECT_TRUE(std::isnan(figures.phase_margin->margin_deg.low));
  EXPECT_TRUE(std::isnan(figures.sensitivity_peak.peak.high));
}

// 2 e^(−0.1 s)/s: phase margin 90° − 0.2 rad, delay margin that over 2 rad/s, gain margin π/0.4.
TEST(LoopAnalysis, FindsTheDelayMarginOfAnIntegratorWithDelay) {
  const LoopFigures figures = figures_of({{}, {0.0}, 2.0, 0.1});
  ASSERT_TRUE(figures.delay_margin);
  EXPECT_NEAR(figures.delay_margin->delay_s.value, pi / 4.0 - 0.1, 1e-10);
  EXPECT_NEAR(figures.gain_margin->margin_db.value, 20.0 * std::log10(pi / 0.4), 1e-9);
}

// 1/(s² + s): |S|² = x(x+1)/(x²−x+1) with x = ω² is largest at x = (1+√3)/2; |T| is the
// second-order low-pass of damping 1/2, whose −3 dB frequency is known.
TEST(LoopAnalysis, FindsTheSensitivityPeakAndTheBandwidth) {
  const LoopFigures figures = figures_of({{}, {0.0, -1.0}, 1.0, 0.0});
  const double x = 0.5 * (1.0 + std::sqrt(3.0));
  EXPECT_NEAR(figures.sensitivity_peak.peak.value, std::sqrt(x * (x + 1.0) / (x * x - x + 1.0)),
              1e-9);
  EXPECT_NEAR(figures.sensitivity_peak.frequency_hz, std::sqrt(x) / turn, 1e-6);
  ASSERT_TRUE(figures.bandwidth_hz);
  EXPECT_NEAR(figures.bandwidth_hz->value, std::sqrt(0.5 + std::sqrt(1.25)) / turn, 1e-9);
}

TEST(LoopAnalysis, FindsResonancesOfModelAndPoints) {
  ZerosPolesGain plant = test::gimbal_b();
  const auto of_model = resonances(LoopModel(plant, {}).curve(turn, turn * 300.0, exact));
  ASSERT_EQ(of_model.size(), 2U);
  EXPECT_NEAR(of_model[0].frequency_hz, 23.0, 0.02);
  EXPECT_NEAR(of_model[1].frequency_hz, 90.0, 0.1);
  const auto points = test::exact_response(plant, test::log_grid(turn, turn * 300.0, 200));
  const auto of_points = resonances(Curve::of_points(points));
  ASSERT_EQ(of_points.size(), 2U);
  ASSERT_TRUE(of_points[0].between_hz);
  EXPECT_NEAR(of_points[0].frequency_hz, 23.0, 0.4);
}

TEST(LoopAnalysis, SaysBetweenWhichPointsItInterpolates) {
  const ZerosPolesGain loop{{}, {0.0, -1.0, -1.0}, 1.0, 0.0};
  const auto points = test::exact_response(loop, test::log_grid(0.1, 10.0, 40));
  const LoopFigures figures = analyse_loop(Curve::of_points(points));
  ASSERT_TRUE(figures.gain_margin);
  EXPECT_NEAR(figures.gain_margin->margin_db.value, 20.0 * std::log10(2.0), 0.05);
  ASSERT_TRUE(figures.gain_margin->between_hz);
  EXPECT_LT(figures.gain_margin->between_hz->first, 1.0 / turn);
  EXPECT_GT(figures.gain_margin->between_hz->second, 1.0 / turn);
}

// The truth is what noise-free points give, so that interpolation is no part of the question.
TEST(LoopAnalysis, IntervalsCoverTheTruthInNineteenOfTwenty) {
  const ZerosPolesGain loop{{}, {0.0, -1.0, -1.0}, 1.0, 0.05};
  const auto grid = test::log_grid(0.1, 10.0, 25);
  const LoopFigures truth = analyse_loop(Curve::of_points(test::exact_response(loop, grid)));
  std::mt19937_64 random(7);
  const int runs = 1000;
  int gain = 0;
  int phase = 0;
  int delay = 0;
  int peak = 0;
  int crossover = 0;
  const auto covers = [](const Bounded& figure, const Bounded& exact_figure) {
    return figure.low <= exact_figure.value && exact_figure.value <= figure.high ? 1 : 0;
  };
  for (int run = 0; run < runs; ++run) {
    const LoopFigures figures =
        analyse_loop(Curve::of_points(test::noisy_response(loop, grid, 0.01, random)));
    gain += covers(figures.gain_margin->margin_db, truth.gain_margin->margin_db);
    phase += covers(figures.phase_margin->margin_deg, truth.phase_margin->margin_deg);
    delay += covers(figures.delay_margin->delay_s, truth.delay_margin->delay_s);
    crossover += covers(figures.phase_margin->frequency_hz, truth.phase_margin->frequency_hz);
    peak += covers(figures.sensitivity_peak.peak, truth.sensitivity_peak.peak);
  }
  for (const int count : {gain, phase, delay, crossover}) {
    EXPECT_GE(count, 930);
    EXPECT_LE(count, 970);
  }
  EXPECT_GE(peak, 900);  // the largest of noisy points is biased upwards
}

TEST(LoopConversions, SAndTAndTheControllerGiveTheLoopBack) {
  const ZerosPolesGain loop{{}, {0.0, -1.0, -1.0}, 1.0, 0.05};
  const auto grid = test::log_grid(0.1, 10.0, 30);
  std::mt19937_64 random(3);
  const Curve L = Curve::of_points(test::noisy_response(loop, grid, 0.02, random));
  const Curve from_S = loop_from(sensitivity(L), LoopSignal::sensitivity);
  const Curve from_T = loop_from(complementary_sensitivity(L), LoopSignal::complementary);
  const Curve P = plant_from_loop(L, LoopModel({{}, {}, 2.0, 0.0}, {}).curve(0.1, 10.0, exact));
  for (const double omega : {0.2, 0.7, 3.0}) {
    const CurvePoint wanted = L.at(omega);
    for (const Curve* curve : {&from_S, &from_T}) {
      EXPECT_LT(std::abs(curve->value(omega) / wanted.value - 1.0), 1e-12);
      EXPECT_NEAR(curve->at(omega).scatter.gain, wanted.scatter.gain, 1e-12);
      EXPECT_NEAR(curve->at(omega).scatter.both, wanted.scatter.both, 1e-12);
      EXPECT_NEAR(curve->at(omega).scatter.phase, wanted.scatter.phase, 1e-12);
    }
    EXPECT_LT(std::abs(P.value(omega) - 0.5 * wanted.value), 1e-12);
  }
}

// δS = −S² δL, against differences.
TEST(LoopConversions, ScatterFollowsTheSlope) {
  const Response points{point_with_relative_scatter(1.0, {0.3, -0.4}, 0.01),
                        point_with_relative_scatter(2.0, {0.1, -0.2}, 0.01)};
  const Curve S = sensitivity(Curve::of_points(points));
  const Complex L{0.3, -0.4};
  const double expected = std::norm(L / (1.0 + L)) * 1e-4;  // circular stays circular
  EXPECT_NEAR(S.at(1.0).scatter.gain, expected, 1e-12);
  EXPECT_NEAR(S.at(1.0).scatter.phase, expected, 1e-12);
  EXPECT_NEAR(S.at(1.0).scatter.both, 0.0, 1e-12);
}

TEST(LoopModel, TellsAStableLoopFromAnUnstableOne) {
  const auto stable = [](double gain, double delay_s, double rate_hz) {
    return LoopModel({{}, {0.0, -1.0, -1.0}, gain, delay_s}, {}, rate_hz).closed_loop_stable();
  };
  EXPECT_TRUE(stable(1.98, 0.0, 0.0));
  EXPECT_FALSE(stable(2.02, 0.0, 0.0));
  const LoopFigures figures = figures_of({{}, {0.0, -1.0, -1.0}, 1.0, 0.0});
  const double delay = figures.delay_margin->delay_s.value;
  EXPECT_TRUE(stable(1.0, 0.99 * delay, 0.0));
  EXPECT_FALSE(stable(1.0, 1.01 * delay, 0.0));
  EXPECT_TRUE(stable(1.9, 0.0, 100.0));
  EXPECT_FALSE(stable(2.05, 0.0, 100.0));
}

// K/s behind a hold closes to z = 1 − KT: stable up to KT = 2, to 1 with a tick of delay.
TEST(LoopModel, KnowsTheLimitsOfSampledIntegrators) {
  const auto stable = [](double gain, double delay_s) {
    return LoopModel({{}, {0.0}, gain, delay_s}, {}, 10.0).closed_loop_stable();
  };
  EXPECT_TRUE(stable(19.9, 0.0));
  EXPECT_FALSE(stable(20.1, 0.0));
  EXPECT_TRUE(stable(9.9, 0.1));
  EXPECT_FALSE(stable(10.1, 0.1));
}

TEST(LoopModel, StabilisesAnUnstablePlant) {
  EXPECT_TRUE(LoopModel({{}, {1.0}, 2.0, 0.0}, {}).closed_loop_stable());   // closes to s + 1
  EXPECT_FALSE(LoopModel({{}, {1.0}, 0.5, 0.0}, {}).closed_loop_stable());  // closes to s − 0.5
}

TEST(LoopModel, RefusesAnImproperControllerAtARate) {
  EXPECT_THROW(LoopModel({{}, {0.0}, 1.0, 0.0}, pid(1.0, 0.0, 0.1, 0.0), 100.0),
               std::invalid_argument);
}

TEST(Pid, IsTheSumOfItsParts) {
  const Complex s{0.0, 3.0};
  const Complex wanted = 2.0 + 5.0 / s + 0.1 * s / (1.0 + s / 40.0);
  EXPECT_LT(std::abs(pid(2.0, 5.0, 0.1, 40.0).at(s) - wanted), 1e-12);
  EXPECT_LT(std::abs(pid(2.0, 0.0, 0.0, 0.0).at(s) - 2.0), 1e-15);
}

}  // namespace
}  // namespace sinerig::identify
