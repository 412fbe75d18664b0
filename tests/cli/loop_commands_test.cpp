// From a sweep of config/gimbal.toml to a notch, each step against the plant of that file.
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sqlite3.h>

#include "identify/biquad.h"
#include "identify/discrete.h"
#include "identify/loop_model.h"
#include "sim/linear_system.h"
#include "sim/plant.h"
#include "support/program.h"

namespace sinerig {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

constexpr double rate_hz = 1000.0;
constexpr double turn = 2.0 * 3.14159265358979323846;
constexpr std::array<double, 4> pid{3.0, 3.0, 0.15, 10.0};
const std::string pid_option = " --pid 3,3,0.15,10";

sim::LinearSystem gimbal() {
  sim::MechanicalAxis axis;
  axis.inertia = 0.02;
  axis.damping = 0.1005;
  axis.lag_hz = 150.0;
  axis.modes = {{23.0, 0.01, 30.66}, {90.0, 0.01, 36.89}};
  sim::LinearSystem system = sim::from_mechanical_axis(axis);
  system.dead_time_s = 0.0015;
  return system;
}

// y = num/den u, descending powers of z, den monic.
class Filter {
 public:
  Filter(std::vector<double> num, std::vector<double> den)
      : num_(std::move(num)), den_(std::move(den)), u_(den_.size()), y_(den_.size()) {
    num_.insert(num_.begin(), den_.size() - num_.size(), 0.0);
  }
  double step(double input) {
    for (std::size_t i = u_.size() - 1; i > 0; --i) {
      u_[i] = u_[i - 1];
      y_[i] = y_[i - 1];
    }
    u_[0] = input;
    y_[0] = 0.0;
    for (std::size_t i = 0; i < num_.size(); ++i) y_[0] += num_[i] * u_[i] - den_[i] * y_[i];
    return y_[0];
  }

 private:
  std::vector<double> num_;
  std::vector<double> den_;
  std::vector<double> u_;
  std::vector<double> y_;
};

// Whether a kick of the exact plant dies away under gain · PID · notches.
bool settles(double gain, const std::vector<Filter>& notches) {
  const identify::DiscreteModel controller =
      identify::tustin(identify::pid(pid[0], pid[1], pid[2], turn * pid[3]), 1.0 / rate_hz);
  std::vector<Filter> chain = notches;
  chain.emplace_back(controller.num(), controller.den());
  sim::Plant plant(gimbal(), 1.0 / rate_hz);
  constexpr int ticks = 60000;
  double early = 0.0;
  double late = 0.0;
  std::array<double, 2> y{};
  for (int n = 0; n < ticks; ++n) {
    const sim::PlantTime now{static_cast<std::uint64_t>(n), 0.0};
    plant.sample(now, y);
    double u = gain * ((n == 0 ? 1.0 : 0.0) - y[0]);
    for (Filter& filter : chain) u = filter.step(u);
    plant.apply(u, now);
    if (!(std::abs(y[1]) < 1e6)) return false;
    if (n > ticks / 4 && n < ticks / 2) early = std::max(early, std::abs(y[1]));
    if (n > 3 * ticks / 4) late = std::max(late, std::abs(y[1]));
  }
  return late < early || late < 1e-9;
}

double simulated_gain_margin_db(const std::vector<Filter>& notches) {
  double low = -30.0;
  double high = 60.0;
  while (high - low > 0.005) {
    const double middle = 0.5 * (low + high);
    (settles(std::pow(10.0, middle / 20.0), notches) ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

std::vector<Filter> filters_of(const json& report) {
  std::vector<Filter> filters;
  for (const json& notch : report.at("notches"))
    filters.emplace_back(notch["biquad"]["b"].get<std::vector<double>>(),
                         notch["biquad"]["a"].get<std::vector<double>>());
  return filters;
}

class GimbalSweep : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    workshop_ = std::make_unique<test::Workshop>();
    const auto run = workshop_->sinerig("run " SINERIG_SOURCE_DIR
                                        "/config/gimbal.toml -o gimbal.sweep --no-report");
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    const auto fit = workshop_->sinerig("fit gimbal.sweep --json");
    ASSERT_EQ(fit.exit_code, 0) << fit.errors;
    fit_ = json::parse(fit.output);
  }
  static void TearDownTestSuite() { workshop_.reset(); }

  static json run_json(const std::string& arguments) {
    const auto run = workshop_->sinerig(arguments);
    EXPECT_EQ(run.exit_code, 0) << run.errors;
    return json::parse(run.output, nullptr, false);
  }

  static std::unique_ptr<test::Workshop> workshop_;
  static json fit_;
};

std::unique_ptr<test::Workshop> GimbalSweep::workshop_;
json GimbalSweep::fit_;

void expect_inside_its_interval(const json& estimate, double truth, double tolerance) {
  const double value = estimate.at("value").get<double>();
  EXPECT_NEAR(value, truth, tolerance);
  EXPECT_NEAR(value, truth, 1.96 * estimate.at("standard_error").get<double>());
}

TEST_F(GimbalSweep, FitRecoversThePlant) {
  int found = 0;
  for (const json& mode : fit_.at("modes")) {
    if (mode["pole"][1].get<double>() == 0.0) continue;
    const double truth_hz = ++found == 1 ? 23.0 : 90.0;
    expect_inside_its_interval(mode["frequency_hz"], truth_hz, 1e-3 * truth_hz);
    expect_inside_its_interval(mode["damping"], 0.01, 0.05 * 0.01);
  }
  EXPECT_EQ(found, 2);
  EXPECT_NEAR(fit_.at("delay_s").get<double>(), 0.0015, 20e-6);
  EXPECT_NEAR(fit_.at("delay_s").get<double>(), 0.0015,
              1.96 * fit_.at("delay_standard_error").get<double>());
  EXPECT_TRUE(fit_.at("converged").get<bool>());
}

TEST_F(GimbalSweep, MarginsOfModelAreThoseOfTheSimulation) {
  const json margins = run_json("margins gimbal.sweep --json" + pid_option);
  EXPECT_TRUE(margins["model"]["stable"].get<bool>());
  EXPECT_EQ(margins["rate_hz"].get<double>(), rate_hz);
  const json& margin = margins["model"]["gain_margin"]["margin_db"];
  const double simulated_db = simulated_gain_margin_db({});
  EXPECT_NEAR(margin["value"].get<double>(), simulated_db, 0.1);
  EXPECT_LT(margin["low"].get<double>(), margin["high"].get<double>());
  // The points see the crossover as the model does.
  const double model_deg = margins["model"]["phase_margin"]["margin_deg"]["value"].get<double>();
  const double points_deg = margins["points"]["phase_margin"]["margin_deg"]["value"].get<double>();
  EXPECT_NEAR(points_deg, model_deg, 1.0);
  EXPECT_EQ(margins["points"]["phase_margin"]["interpolated_between_hz"].size(), 2U);
}

TEST_F(GimbalSweep, NotchRaisesTheGainMarginAsStated) {
  const json report = run_json("notch gimbal.sweep --json" + pid_option);
  const json& notch = report.at("notches").at(0);
  EXPECT_NEAR(notch["frequency_hz"].get<double>(), 23.0, 0.023);
  EXPECT_GE(notch["worst_attenuation_db"].get<double>(), notch["attenuation_db"].get<double>());
  const double before_db = report["before"]["gain_margin"]["margin_db"]["value"].get<double>();
  const double after_db = report["after"]["gain_margin"]["margin_db"]["value"].get<double>();
  EXPECT_TRUE(report["after"]["stable"].get<bool>());
  EXPECT_GT(after_db, before_db + 3.0);
  const double simulated_before_db = simulated_gain_margin_db({});
  const double simulated_after_db = simulated_gain_margin_db(filters_of(report));
  EXPECT_NEAR(before_db, simulated_before_db, 0.1);
  EXPECT_NEAR(after_db, simulated_after_db, 0.1);
  RecordProperty("raised_db", std::to_string(simulated_after_db - simulated_before_db));
  // The stated phase cost is what the crossover loses.
  const double cost_deg = notch["phase_cost_deg"].get<double>();
  EXPECT_GT(cost_deg, 0.0);
  EXPECT_LT(cost_deg, 15.0);
}

TEST_F(GimbalSweep, NotchesInCascadeAndForDrift) {
  const json both = run_json("notch gimbal.sweep --at 90,23 --json" + pid_option);
  ASSERT_EQ(both["notches"].size(), 2U);
  EXPECT_NEAR(both["notches"][1]["frequency_hz"].get<double>(), 90.0, 0.1);
  EXPECT_TRUE(both["after"]["stable"].get<bool>());
  EXPECT_NEAR(both["after"]["gain_margin"]["margin_db"]["value"].get<double>(),
              simulated_gain_margin_db(filters_of(both)), 0.1);
  const json one = run_json("notch gimbal.sweep --attenuation 20 --json");
  const json drifting = run_json("notch gimbal.sweep --attenuation 20 --within 0.5 --json");
  EXPECT_GT(drifting["notches"][0]["width_hz"].get<double>(),
            2.0 * one["notches"][0]["width_hz"].get<double>());
  EXPECT_TRUE(one["before"].is_null());
}

TEST_F(GimbalSweep, NotchPrintsCoefficientsForPeopleAndCompilers) {
  const auto text = workshop_->sinerig("notch gimbal.sweep" + pid_option);
  EXPECT_THAT(text.output, HasSubstr("notch at 2"));
  EXPECT_THAT(text.output, HasSubstr("phase cost"));
  const auto source = workshop_->sinerig("notch gimbal.sweep --at 23,90 --format c");
  ASSERT_EQ(source.exit_code, 0) << source.errors;
  EXPECT_THAT(source.output, HasSubstr("static const double notch[2][5] = {"));
  workshop_->write("notch.c",
                   "#include <stdint.h>\n" + source.output +
                       "int main(void) { return notch[0][0] * 1073741824.0 - notch_fixed[0][0] > "
                       "0.6; }\n");
  if (workshop_->shell("command -v cc").exit_code == 0) {
    const auto compiled = workshop_->shell("cc -Wall -Werror notch.c -o notch && ./notch");
    EXPECT_EQ(compiled.exit_code, 0) << compiled.errors;
  }
}

TEST_F(GimbalSweep, RefusesWhatCannotBeHad) {
  const auto refuses = [](const std::string& arguments, const std::string& message) {
    const auto run = workshop_->sinerig(arguments);
    EXPECT_EQ(run.exit_code, 2) << arguments;
    EXPECT_THAT(run.errors, HasSubstr(message));
  };
  refuses("notch gimbal.sweep --at 40", "the model has no resonance near 40 Hz; it has 2");
  refuses("notch gimbal.sweep --fixed 1.31", "does not fit Q1.31");
  refuses("notch gimbal.sweep --attenuation -3", "the attenuation must be above 0 dB");
  refuses("notch gimbal.sweep --crossover 40",
          "the crossover must lie between 0 and the resonance");
  refuses("margins gimbal.sweep --pid 1,2", "--pid: wanted KP,KI,KD");
  refuses("margins gimbal.sweep --controller-num 1,2", "belong together");
  refuses("margins gimbal.sweep --pid 1,2,3", "filter its derivative");
  refuses("margins gimbal.sweep --pid 1,2,3", "give FILTER_HZ as the fourth number, or --rate 0");
  EXPECT_EQ(workshop_->sinerig("margins gimbal.sweep --pid 1,2,3").output, "");
  refuses("notch gimbal.sweep --within 30", "--within 30: must be below the resonance at 2");
  refuses("margins gimbal.sweep --response loop --pid 1,2,3,40", "holds the controller already");
}

// What an interruption and `resume` leave: a fit of the points that there were then.
TEST_F(GimbalSweep, FitsAgainWhatHasMorePointsThanItsFit) {
  ASSERT_EQ(workshop_->shell("cp gimbal.sweep resumed.sweep").exit_code, 0);
  const auto change = [](const char* sql) {
    sqlite3* file = nullptr;
    ASSERT_EQ(sqlite3_open((workshop_->folder() / "resumed.sweep").c_str(), &file), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(file, sql, nullptr, nullptr, nullptr), SQLITE_OK);
    sqlite3_close(file);
  };
  change("UPDATE point SET status = 'stopped' WHERE freq_hz > 60");
  ASSERT_EQ(workshop_->sinerig("fit resumed.sweep").exit_code, 0);
  const auto fresh = workshop_->sinerig("margins resumed.sweep" + pid_option);
  EXPECT_THAT(fresh.errors, Not(HasSubstr("fitting it again")));
  change("UPDATE point SET status = 'good'");
  const auto resumed = workshop_->sinerig("margins resumed.sweep" + pid_option);
  EXPECT_EQ(resumed.exit_code, 0) << resumed.errors;
  EXPECT_THAT(resumed.errors, HasSubstr("made without; fitting it again"));
  EXPECT_EQ(resumed.output, workshop_->sinerig("margins gimbal.sweep" + pid_option).output);
  EXPECT_THAT(workshop_->sinerig("margins resumed.sweep").errors, Not(HasSubstr("fitting it")));
}

// 10 e^(−2 ms s)/(s/10π + 1) to 20 Hz: the phase crosses 180° at 128.1 Hz, far beyond.
TEST(MarginsCommand, SearchesTheModelToWhereItsPhaseCrosses) {
  const test::Workshop workshop;
  std::string csv;
  for (int i = 0; i < 40; ++i) {
    const double hz = 0.1 * std::pow(200.0, i / 39.0);
    const std::complex<double> s{0.0, turn * hz};
    const std::complex<double> H = 10.0 / (s / (5.0 * turn) + 1.0) * std::exp(-2e-3 * s);
    char line[160];
    std::snprintf(line, sizeof line, "%.17g,%.17g,%.17g,%.6g\n", hz, H.real(), H.imag(),
                  1e-3 * std::abs(H));
    csv += line;
  }
  workshop.write("axis.csv", csv);
  const auto model_of = [&](const std::string& gains) {
    const auto run = workshop.sinerig("margins axis.csv --json --pid " + gains);
    EXPECT_EQ(run.exit_code, 0) << run.errors;
    return json::parse(run.output)["model"];
  };
  // atan(f/5 Hz) + 2π f · 2 ms = π, and |L| = 10/√(1 + (f/5 Hz)²) there.
  const json one = model_of("1,0,0");
  EXPECT_NEAR(one["gain_margin"]["margin_db"]["value"].get<double>(), 8.178, 0.01);
  const json thirty = model_of("30,0,0");
  EXPECT_FALSE(thirty["stable"].get<bool>());
  EXPECT_LT(thirty["gain_margin"]["margin_db"]["value"].get<double>(), -20.0);
  const auto points = workshop.sinerig("margins axis.csv --points-only --pid 1,0,0");
  EXPECT_THAT(points.output, HasSubstr("does not cross 180° up to 20 Hz"));
  EXPECT_THAT(workshop.sinerig("margins axis.csv --points-only --pid 30,0,0").output,
              HasSubstr("does not cross 1 up to 20 Hz"));
}

TEST(MarginsCommand, TakesUnitsThatLookWrongWhenToldTo) {
  const test::Workshop workshop;
  workshop.write("bode.csv", "1,-3,-40\n2,-10,-80\n4,-20,-120\n8,-31,-150\n16,-43,-165\n");
  for (const std::string command : {"margins bode.csv --points-only", "notch bode.csv"})
    EXPECT_THAT(workshop.sinerig(command).errors, HasSubstr("say --trust-units"));
  EXPECT_EQ(workshop.sinerig("margins bode.csv --points-only --trust-units").exit_code, 0);
  EXPECT_THAT(workshop.sinerig("notch bode.csv --trust-units").errors,
              Not(HasSubstr("say --trust-units")));
}

TEST(MarginsCommand, FitsFirstAndSaysSo) {
  const test::Workshop workshop;
  std::string csv;
  for (int i = 0; i < 30; ++i) {
    const double hz = 0.1 * std::pow(100.0, i / 29.0);
    const std::complex<double> s{0.0, turn * hz};
    const std::complex<double> H = 10.0 / (s * (1.0 + 0.02 * s)) * std::exp(-0.01 * s);
    csv += std::to_string(hz) + "," + std::to_string(H.real()) + "," + std::to_string(H.imag()) +
           "," + std::to_string(1e-3 * std::abs(H)) + "\n";
  }
  workshop.write("axis.csv", csv);
  const auto run = workshop.sinerig("margins axis.csv");
  EXPECT_EQ(run.exit_code, 0) << run.errors;
  EXPECT_THAT(run.errors, HasSubstr("axis.csv holds no fit; fitting it first"));
  EXPECT_THAT(run.output, HasSubstr("model: closed loop stable"));
  EXPECT_THAT(run.output, HasSubstr("interpolated between"));
}

const std::string config = SINERIG_SOURCE_DIR "/config/";

TEST(MarginsCommand, CountsTheHoldOfAnExportedResponseOnce) {
  const test::Workshop workshop;
  ASSERT_EQ(workshop.sinerig("run " + config + "two-mass.toml -o axis.sweep --no-report").exit_code,
            0);
  ASSERT_EQ(workshop.sinerig("export axis.sweep --channel motor -o axis.csv").exit_code, 0);
  ASSERT_EQ(
      workshop.sinerig("export axis.sweep --channel motor --format uff -o axis.uff").exit_code, 0);
  // What a program wrote that knows of no hold.
  ASSERT_EQ(workshop.shell("cut -d, -f1-3,6-8 axis.csv > bare.csv").exit_code, 0);
  const std::string pid_at = " --json --rate 2000 --pid 0.2,0.5,0.01,20";
  const auto margin = [&](const std::string& arguments) {
    const auto run = workshop.sinerig("margins " + arguments + pid_at);
    EXPECT_EQ(run.exit_code, 0) << run.errors;
    return json::parse(run.output)["model"]["phase_margin"]["margin_deg"]["value"].get<double>();
  };
  const double of_sweep = margin("axis.sweep");
  EXPECT_NEAR(of_sweep, 71.54, 0.1);
  EXPECT_NEAR(margin("axis.csv"), of_sweep, 0.05);
  EXPECT_NEAR(margin("axis.uff"), of_sweep, 0.05);
  EXPECT_NEAR(margin("bare.csv --hold 2000"), of_sweep, 0.05);
  const auto bare = workshop.sinerig("margins bare.csv" + pid_at);
  EXPECT_THAT(bare.errors, HasSubstr("does not say the rate of the loop"));
  EXPECT_EQ(margin("bare.csv --hold none"), margin("bare.csv --hold 0"));
  ASSERT_EQ(workshop.sinerig("fit axis.sweep --hold none").exit_code, 0);
  EXPECT_NEAR(margin("axis.sweep"), of_sweep, 0.05);
}

// Other programs write no scatter. Taken for noise that is the same everywhere, what noise there is
// was followed with 8 poles, and the notch sat on one of them at 30.6 Hz; the second asked for 11.
TEST(NotchCommand, IsTheSameWithoutScatter) {
  struct Rig {
    std::string name, channel;
    std::size_t poles;
  };
  for (const Rig& rig : {Rig{"two-mass", "motor", 3}, Rig{"gimbal", "encoder", 7}}) {
    SCOPED_TRACE(rig.name);
    const test::Workshop workshop;
    const auto write = [&](const std::string& command) {
      const auto run = workshop.sinerig(command);
      ASSERT_EQ(run.exit_code, 0) << run.errors;
    };
    write("run " + config + rig.name + ".toml -o axis.sweep --no-report");
    write("export axis.sweep --channel " + rig.channel + " -o axis.csv");
    write("export axis.sweep --channel " + rig.channel + " --format uff -o axis.uff");
    ASSERT_EQ(workshop.shell("cut -d, -f1-3 axis.csv > bare.csv").exit_code, 0);
    const auto frequency_hz = [&](const std::string& file) {
      const auto run = workshop.sinerig("notch --json " + file);
      EXPECT_EQ(run.exit_code, 0) << run.errors;
      const std::string warning = file + " holds no scatter";
      const std::size_t at = run.errors.find(warning);
      EXPECT_EQ(at != std::string::npos, file != "axis.sweep") << run.errors;
      EXPECT_EQ(run.errors.rfind(warning), at) << "said twice";
      return json::parse(run.output)["notches"][0]["frequency_hz"].get<double>();
    };
    const double of_sweep_hz = frequency_hz("axis.sweep");
    EXPECT_NEAR(frequency_hz("axis.uff"), of_sweep_hz, 0.01 * of_sweep_hz);
    EXPECT_NEAR(frequency_hz("bare.csv"), of_sweep_hz, 0.01 * of_sweep_hz);
    const auto fit = workshop.sinerig("fit --json axis.uff");
    ASSERT_EQ(fit.exit_code, 0) << fit.errors;
    EXPECT_EQ(json::parse(fit.output)["poles"].size(), rig.poles);
    // Points that nobody knows the scatter of have no interval of no width.
    const auto margins = workshop.sinerig("margins --points-only axis.uff");
    EXPECT_THAT(margins.output, HasSubstr("(interval not known)"));
    EXPECT_THAT(margins.output, Not(testing::ContainsRegex("[0-9] to [0-9]")));
  }
}

TEST(MarginsCommand, TakesALoopThatWasMeasuredWithTheOtherSign) {
  const test::Workshop workshop;
  ASSERT_EQ(
      workshop.sinerig("run " + config + "closed-loop.toml -o axis.sweep --no-report").exit_code,
      0);
  const std::string loop = "margins axis.sweep --channel control --response loop";
  const auto wrong = workshop.sinerig(loop);
  EXPECT_THAT(wrong.errors, HasSubstr("--negate"));
  const auto right = workshop.sinerig(loop + " --negate");
  EXPECT_EQ(right.exit_code, 0) << right.errors;
  EXPECT_THAT(right.errors, Not(HasSubstr("sign")));
  EXPECT_THAT(right.output, HasSubstr("57.67"));
  const auto sensitivity = workshop.sinerig("fit axis.sweep --channel torque/applied --json");
  EXPECT_THAT(sensitivity.errors, HasSubstr("on the loop's side of its hold"));
  EXPECT_EQ(json::parse(sensitivity.output)["hold_period_s"], 0.0);
}

TEST(MarginsCommand, KeepsARigThatStoodStable) {
  const test::Workshop workshop;
  ASSERT_EQ(workshop.sinerig("run " + config + "servo.toml -o servo.sweep --no-report").exit_code,
            0);
  EXPECT_THAT(workshop.sinerig("fit servo.sweep --no-store").errors, HasSubstr("--stable"));
  const auto margins = workshop.sinerig("margins servo.sweep --pid 0.1,0.5,0");
  EXPECT_EQ(margins.exit_code, 0) << margins.errors;
  EXPECT_THAT(margins.errors, HasSubstr("fitting with --stable"));
  EXPECT_THAT(margins.output, HasSubstr("model: closed loop stable"));
  ASSERT_EQ(workshop.sinerig("fit servo.sweep --poles 6 --zeros 2").exit_code, 0);
  EXPECT_THAT(workshop.sinerig("margins servo.sweep --pid 0.1,0.5,0").errors,
              HasSubstr("the stored fit of servo.sweep is unstable"));
}

TEST(FitOfASweep, IsDoneWithoutNoise) {
  const test::Workshop workshop;
  ASSERT_EQ(
      workshop.sinerig("run " + config + "chebyshev.toml -o filter.sweep --no-report").exit_code,
      0);
  const auto fit = workshop.sinerig("fit filter.sweep --json");
  ASSERT_EQ(fit.exit_code, 0) << fit.errors;
  const json model = json::parse(fit.output);
  ASSERT_EQ(model["den"].size(), 4U);
  EXPECT_NEAR(model["den"][1].get<double>(), 347.0, 1e-3);
  EXPECT_NEAR(model["num"].back().get<double>(), 309673.0, 1.0);
}

// Each file is held against the first; one that shares nothing with it is not the same.
TEST(CompareCommand, FailsForAFileThatCannotBeCompared) {
  const test::Workshop workshop;
  workshop.write("a.csv", "freq_hz,re,im,std\n1,1,0,0.1\n2,1,0,0.1\n");
  workshop.write("same.csv", "freq_hz,re,im,std\n1,1,0,0.1\n2,1,0,0.1\n");
  workshop.write("other.csv", "freq_hz,re,im,std\n3,1,0,0.1\n4,1,0,0.1\n");
  EXPECT_EQ(workshop.sinerig("compare a.csv same.csv").exit_code, 0);
  const auto run = workshop.sinerig("compare a.csv same.csv other.csv --json");
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.errors, HasSubstr("other: nothing to compare"));
  const json differences = json::parse(run.output)["differences"];
  EXPECT_EQ(differences[0]["compared"], 2);
  EXPECT_EQ(differences[1]["compared"], 0);
}

}  // namespace
}  // namespace sinerig
