#include "identify/notch.h"

#include <cmath>
#include <complex>
#include <numbers>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

namespace sinerig::identify {
namespace {

constexpr double turn = 2.0 * std::numbers::pi;

Mode mode(double frequency_hz, double error_hz, double damping = 0.01, double damping_error = 0.0) {
  Mode out{};
  out.frequency_hz = {frequency_hz, error_hz};
  out.damping = {damping, damping_error};
  return out;
}

TEST(UncertainMode, IsTheHullOfSeveralFits) {
  const UncertainMode hull = uncertain_mode({mode(23.0, 0.1), mode(23.6, 0.05, 0.012, 0.001)});
  EXPECT_NEAR(hull.low_hz, 23.0 - 0.196, 1e-4);
  EXPECT_NEAR(hull.high_hz, 23.6 + 0.098, 1e-4);
  EXPECT_NEAR(hull.damping_low, 0.01, 1e-4);
  EXPECT_NEAR(hull.damping_high, 0.01396, 1e-4);
  EXPECT_THROW(uncertain_mode({}), std::invalid_argument);
  EXPECT_THROW(uncertain_mode({mode(23.0, 0.1, 1.2)}), std::invalid_argument);
}

// A mode much narrower than its interval: pole damping v/a, zero damping v·a.
TEST(DesignNotch, ReachesTheClosedFormForASharpMode) {
  const UncertainMode sharp = uncertain_mode({mode(30.0, 0.5, 1e-6)});
  const NotchDesign design = design_notch(sharp, {20.0, 2.0, 0.0});
  const double x = sharp.low_hz / sharp.frequency_hz;
  const double v = std::abs(1.0 - x * x) / (2.0 * x);
  EXPECT_NEAR(design.notch.pole_damping, v / 0.1, 0.05 * v / 0.1);
  EXPECT_NEAR(design.notch.pole_damping - design.notch.zero_damping, v * (10.0 - 0.1),
              0.005 * v * 9.9);
}

// Peak of mode times notch over peak of mode, on a grid of its own.
double peak_reduction_db(const Notch& notch, double frequency_hz, double damping) {
  double alone = 0.0;
  double reduced = 0.0;
  for (double x = 0.9; x < 1.1; x += 2e-5) {
    const double M = 1.0 / std::abs(std::complex<double>{1.0 - x * x, 2.0 * damping * x});
    alone = std::max(alone, M);
    reduced = std::max(reduced, M * std::abs(notch.at(turn * frequency_hz * x)));
  }
  return 20.0 * std::log10(alone / reduced);
}

TEST(DesignNotch, KeepsTheAttenuationOverTheWholeInterval) {
  const UncertainMode wide = uncertain_mode({mode(23.0, 0.05, 0.01, 0.0005), mode(23.5, 0.05)});
  for (const double rate_hz : {0.0, 1000.0, 200.0}) {
    const NotchDesign design = design_notch(wide, {15.0, 3.0, rate_hz});
    EXPECT_GE(design.worst_attenuation_db, 15.0);
    EXPECT_LT(design.worst_attenuation_db, 15.05);
    for (double f = wide.low_hz; f <= wide.high_hz; f += (wide.high_hz - wide.low_hz) / 20.0)
      EXPECT_GE(peak_reduction_db(design.notch, f, wide.damping_low), 14.95) << f;
  }
}

TEST(DesignNotch, NoOtherNotchDoesItForLessPhase) {
  const UncertainMode wide = uncertain_mode({mode(23.0, 0.1, 0.01, 0.0005)});
  const NotchDesign design = design_notch(wide, {15.0, 5.0, 1000.0});
  for (double zero = 0.0005; zero < 0.2; zero *= 1.15)
    for (double pole = 0.005; pole < 1.0; pole *= 1.05) {
      const Notch other{wide.frequency_hz, zero, pole, 1000.0};
      if (worst_attenuation_db(other, wide) < 15.0) continue;
      EXPECT_GE(-other.phase_deg(5.0), design.phase_cost_deg - 1e-3) << zero << " " << pole;
    }
}

TEST(DesignNotch, CostsMoreForMoreDriftAndSaysWhatCannotBe) {
  const UncertainMode narrow = uncertain_mode({mode(23.0, 0.01)});
  const UncertainMode wide = uncertain_mode({mode(23.0, 0.5)});
  const NotchRequest request{20.0, 5.0, 1000.0};
  EXPECT_LT(2.0 * design_notch(narrow, request).phase_cost_deg,
            design_notch(wide, request).phase_cost_deg);
  EXPECT_THROW(design_notch(narrow, {0.0, 5.0, 1000.0}), std::invalid_argument);
  EXPECT_THROW(design_notch(narrow, {20.0, 25.0, 1000.0}), std::invalid_argument);
  EXPECT_THROW(design_notch(narrow, {20.0, 5.0, 40.0}), std::invalid_argument);
  EXPECT_THROW(design_notch(uncertain_mode({mode(23.0, 5.0)}), {40.0, 1.0, 1000.0}),
               std::invalid_argument);
}

TEST(Biquad, IsTheNotchAtEveryFrequency) {
  const Notch notch{23.0, 0.01, 0.2, 1000.0};
  const Biquad biquad = biquad_of(notch);
  EXPECT_TRUE(biquad.stable());
  for (const double hz : {0.5, 10.0, 23.0, 90.0, 400.0})
    EXPECT_LT(std::abs(biquad.at(turn * hz / 1000.0) - notch.at(turn * hz)), 1e-12);
  EXPECT_NEAR(20.0 * std::log10(std::abs(biquad.at(turn * 0.023))), notch.depth_db(), 1e-9);
  EXPECT_NEAR(notch.depth_db(), -26.0206, 1e-4);
  EXPECT_THROW(biquad_of(Notch{23.0, 0.01, 0.2, 0.0}), std::invalid_argument);
  EXPECT_THROW(biquad_of(Notch{23.0, 0.01, 0.2, 40.0}), std::invalid_argument);
}

TEST(Biquad, RoundsToFixedPoint) {
  const Biquad biquad = biquad_of(Notch{23.0, 0.01, 0.2, 1000.0});
  const FixedBiquad fixed = quantised(biquad, 32, 30);
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_NEAR(fixed.value().coefficients()[i], biquad.coefficients()[i], std::ldexp(0.5, -30));
  EXPECT_THROW(quantised(biquad, 16, 15), std::invalid_argument);  // a1 is near −2
  EXPECT_THROW(quantised(biquad, 32, 32), std::invalid_argument);
  EXPECT_THROW(quantised(biquad_of(Notch{0.05, 0.01, 0.2, 10000.0}), 16, 14),
               std::invalid_argument);
}

// The −3 dB frequencies of the notch itself, found by bisection.
TEST(NotchWidth, IsThatOfTheDiscreteNotchWhereItHasARate) {
  for (const double rate_hz : {0.0, 5000.0, 500.0}) {
    const Notch notch{100.0, 1e-6, 0.127, rate_hz};
    const auto edge = [&](double inside, double outside) {
      for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (inside + outside);
        const bool deep = std::norm(notch.at(2.0 * std::numbers::pi * middle)) < 0.5;
        (deep ? inside : outside) = middle;
      }
      return inside;
    };
    EXPECT_NEAR(notch.width_hz(), edge(100.0, 240.0) - edge(100.0, 1.0), 1e-3) << rate_hz;
  }
}

TEST(DesignNotch, SaysHowMuchADampedResonanceAllows) {
  const UncertainMode damped = uncertain_mode({mode(2.5, 0.001, 0.158)});
  std::string refusal;
  try {
    design_notch(damped, {20.0, 0.6, 0.0});
  } catch (const std::invalid_argument& error) {
    refusal = error.what();
  }
  const std::string before = " Hz, allows ";
  const std::size_t at = refusal.find(before);
  ASSERT_NE(at, std::string::npos) << refusal;
  const double most_db = std::stod(refusal.substr(at + before.size()));
  EXPECT_GT(most_db, 10.0);
  EXPECT_LT(most_db, 20.0);
  EXPECT_NO_THROW(design_notch(damped, {most_db - 0.5, 0.6, 0.0}));
  EXPECT_THROW(design_notch(damped, {most_db + 0.5, 0.6, 0.0}), std::invalid_argument);
}

}  // namespace
}  // namespace sinerig::identify
