// The files of config/ are the reference of every key: each loads, plans and, with its noise off,
// measures its own closed form; every key that is read is explained in them.
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>

#include <gmock/gmock.h>

#include "drivers/can/can_driver.h"
#include "drivers/gpio/gpio_driver.h"
#ifdef SINERIG_HAS_MODBUS
#include "drivers/modbus/modbus_driver.h"
#endif
#include "support/exactness.h"
#include "support/rig_text.h"

namespace sinerig {
namespace {

using test::Complex;
using test::PartialFractions;
using test::shipped;
using test::text_of;

std::vector<std::string> shipped_files() {
  std::vector<std::string> paths;
  for (const auto& entry : std::filesystem::directory_iterator{shipped("")}) {
    const std::string path = entry.path().string();
    // What describes a simulated device beside a rig has no loop.
    if (!path.ends_with(".toml")) continue;
    const std::string text = text_of(path);
    const bool rig = text.find("[loop]") != std::string::npos;
#ifdef SINERIG_HAS_MODBUS
    const bool has_driver = true;
#else
    const bool has_driver = text.find("driver = \"modbus\"") == std::string::npos;
#endif
    if (rig && has_driver) paths.push_back(path);
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

TEST(ShippedFiles, HoldAtLeastTheFourThatTheManualNames) {
  std::vector<std::string> names;
  for (const std::string& path : shipped_files()) {
    names.push_back(std::filesystem::path{path}.filename().string());
  }
  EXPECT_THAT(names, testing::IsSupersetOf(
                         {"chebyshev.toml", "gimbal.toml", "servo.toml", "two-mass.toml"}));
}

std::vector<DriverKit> drivers() {
  // Nothing is opened here.
  return {
      sim::sim_driver(),
      can::can_driver(),
      gpio::gpio_driver([] { return nullptr; }),
#ifdef SINERIG_HAS_MODBUS
      modbus::modbus_driver(),
#endif
  };
}

class ShippedFile : public testing::TestWithParam<std::string> {};

TEST_P(ShippedFile, LoadsAndPlans) {
  const cli::ConfiguredRig configured{GetParam(), drivers()};
  const SweepPlan plan = configured.rig().plan();
  EXPECT_GE(plan.dwells.size(), 10U);
  EXPECT_GT(plan.min_seconds(), 1.0);
}

TEST_P(ShippedFile, AcceptsEveryCommentedKeyAtTheDefaultThatItShows) {
  const std::string text = text_of(GetParam());
  std::istringstream lines{text};
  std::string line;
  std::size_t offset = 0;
  while (std::getline(lines, line)) {
    std::smatch match;
    const bool commented = std::regex_search(line, match, std::regex{"^# ([a-z0-9_]+) = "});
    // These stand in place of other keys; chebyshev.toml shows a second kind of plant, the CAN rig
    // a channel without a profile, the GPIO rig the other kinds of output.
    const std::string key = commented ? match[1].str() : "";
    const bool alternative = key == "amplitude_table" || key == "frequencies_hz" || key == "not" ||
                             key == "at_most" || key == "at_least" || key == "sub_band_table" ||
                             GetParam().ends_with("byshev.toml") ||
                             text.find("driver = \"can\"") != std::string::npos ||
                             text.find("driver = \"gpio\"") != std::string::npos;
    if (commented && !alternative) {
      std::string edited = text;
      edited.erase(offset, 2);
      const std::string path = test::own_file("uncommented.toml");
      test::write_text(path, edited);
      EXPECT_NO_THROW((cli::ConfiguredRig{path, drivers()}.rig().plan())) << line;
    }
    offset += line.size() + 1;
  }
}

INSTANTIATE_TEST_SUITE_P(Each, ShippedFile, testing::ValuesIn(shipped_files()),
                         [](const auto& instance) {
                           std::string name = std::filesystem::path{instance.param}.stem();
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

// "section.key" of every key that a file explains, live or in a comment.
void collect_documented(const std::string& text, std::set<std::string>& documented) {
  const std::regex header{R"(^#? ?\[\[?([a-z_]+)(\.[A-Za-z_-]+)?\]\]?)"};
  const std::regex entry{R"(^#? ?([a-z0-9_]+) = )"};
  std::istringstream lines{text};
  std::string line;
  std::string section;
  while (std::getline(lines, line)) {
    std::smatch match;
    if (std::regex_search(line, match, header)) {
      const bool named = match[1].str() == "sensor" || match[1].str() == "modbus";
      section = named ? match[1].str() + ".NAME" : match[1].str() + match[2].str();
      documented.insert(section);
    } else if (std::regex_search(line, match, entry)) {
      documented.insert(section + "." + match[1].str());
    }
  }
}

constexpr const char* bare_rig =
    "[loop]\nrate_hz = 1000\n[sweep]\nSWEEP\namplitude = 1\n[limits]\n[actuator]\n"
    "[sensor.y]\n[output]\n[plant]\nPLANT\n";

std::string bare_rig_with(const std::string& sweep, const std::string& plant) {
  const std::string with_sweep = std::regex_replace(bare_rig, std::regex{"SWEEP"}, sweep);
  return std::regex_replace(with_sweep, std::regex{"PLANT"}, plant);
}

TEST(EveryKeyThatIsRead, IsExplainedInTheShippedFiles) {
  std::set<std::string> documented;
  std::set<std::string> known;
  const auto read = [&](const std::string& path) {
    const cli::ConfiguredRig configured{path, drivers()};
    known.insert(configured.rig().file->known_keys().begin(),
                 configured.rig().file->known_keys().end());
  };
  for (const std::string& path : shipped_files()) {
    collect_documented(text_of(path), documented);
    // The keys of a CAN channel are explained in the device profiles as well: see the tests of CAN.
    if (text_of(path).find("driver = \"can\"") == std::string::npos) read(path);
  }
  const std::string ends = "start_hz = 1\nstop_hz = 9\npoints = 3";
  for (const std::string& text :
       {bare_rig_with("spacing = \"list\"\nfrequencies_hz = [1, 2]", "inertia = 1"),
        bare_rig_with(ends,
                      "kind = \"mechanical\"\ninertia = 1\n[[plant.modes]]\n"
                      "frequency_hz = 5\ndamping = 0.1\nresidue = 1"),
        bare_rig_with(ends, "kind = \"transfer_function\"\nnum = [1]\nden = [1, 1]"),
        bare_rig_with(ends, "kind = \"zeros_poles\"\ngain = 1\nzeros = []\npoles = [-1]"),
        bare_rig_with(ends,
                      "kind = \"state_space\"\noutputs = [\"y\"]\na = [[-1]]\nb = [1]\n"
                      "c = [[1]]\nd = [0]")}) {
    const std::string path = test::own_file("synthetic.toml");
    test::write_text(path, text);
    read(path);
  }
  EXPECT_GT(known.size(), 60U);
  for (std::string key : known) {
    // A step of a list is the same in all lists, and its number the same as that of a channel.
    key = std::regex_replace(key, std::regex{R"(^actuator\.(startup|disarm|shutdown)\.)"},
                             "actuator.arm.");
    const std::string number = std::regex_replace(
        key,
        std::regex{
            R"(^actuator\.(arm|health)\.(type|word_order|byte_order|scale|offset|unit_id)$)"},
        "actuator.$2");
    const std::string table = std::regex_replace(
        number, std::regex{R"(^actuator\.(arm|health)\.table$)"}, "sensor.NAME.table");
    const std::string place = std::regex_replace(
        table, std::regex{R"(^sensor\.NAME\.(word_order|byte_order|scale|offset|unit_id)$)"},
        "actuator.$1");
    EXPECT_TRUE(documented.contains(key) || documented.contains(place))
        << key << " is explained in no file of config/";
  }
}

// gain · (s^derivative) / (inertia s² + damping s + stiffness) behind a first-order lag; lag 0 =
// none.
PartialFractions second_order(long double gain, long double inertia, long double damping,
                              long double stiffness, std::size_t derivative,
                              long double lag_rad_s) {
  const Complex root = std::sqrt(Complex{damping * damping - 4.0L * inertia * stiffness, 0.0L});
  std::vector<Complex> poles{(-damping + root) / (2.0L * inertia),
                             (-damping - root) / (2.0L * inertia)};
  gain /= inertia;
  if (lag_rad_s > 0.0L) {
    poles.emplace_back(-lag_rad_s);
    gain *= lag_rad_s;
  }
  const std::vector<Complex> zeros(derivative, Complex{});
  return test::partial_fractions(zeros, poles, gain);
}

void add(PartialFractions& sum, const PartialFractions& part) {
  sum.poles.insert(sum.poles.end(), part.poles.begin(), part.poles.end());
  sum.residues.insert(sum.residues.end(), part.residues.begin(), part.residues.end());
}

void expect_exact(const test::ConfiguredRun& run, std::uint16_t output,
                  const PartialFractions& reference) {
  EXPECT_FALSE(run.outcome.trip.tripped());
  const auto exact = [&](long double omega) {
    return test::held_response(reference, omega, 1.0L / static_cast<long double>(run.plan.rate_hz));
  };
  EXPECT_LT(test::worst_error(run.sink.points, output, exact), 1e-9);
}

std::string noiseless(const std::string& name, const std::string& settle_s) {
  std::string text = test::without_keys(
      text_of(shipped(name)), {"noise_rms", "pink_noise_rms", "quantum", "bias", "drift_per_s",
                               "backlash", "clip_min", "clip_max", "bias_amplitude", "bias_hz",
                               "coulomb_friction", "breakaway_friction", "stribeck_velocity"});
  text = test::without_keys(
      text, {"settling", "settle_cycles", "settle_s", "settle_max_cycles", "settle_max_s",
             "integrate_cycles", "integrate_s", "target_db", "target_deg"});
  text.replace(text.find("[sweep]\n"), 8,
               "[sweep]\nsettling = \"fixed\"\nsettle_s = " + settle_s +
                   "\ntarget_db = 0\ntarget_deg = 0\nintegrate_cycles = 4\n");
  return test::with_key(text, "points", "15");
}

TEST(ExactnessOfAShippedFile, Gimbal) {
  constexpr long double two_pi = 2.0L * std::numbers::pi_v<long double>;
  const auto run = test::run_text(noiseless("gimbal.toml", "26"));
  for (const std::size_t derivative : {0U, 1U}) {
    const auto part = [&](long double gain, long double inertia, long double damping,
                          long double stiffness) {
      return second_order(gain, inertia, damping, stiffness, derivative, two_pi * 150.0L);
    };
    PartialFractions axis = part(1.0L, 0.02, 0.1005, 0.0L);
    for (const auto& [hz, residue] : {std::pair{23.0, 30.66}, std::pair{90.0, 36.89}}) {
      const long double omega = two_pi * static_cast<long double>(hz);
      add(axis, part(residue, 1.0L, 2.0L * static_cast<long double>(0.01) * omega, omega * omega));
    }
    axis.delay_s = 0.0015;
    expect_exact(run, static_cast<std::uint16_t>(first_sensor_channel + derivative), axis);
  }
}

TEST(ExactnessOfAShippedFile, Servo) {
  std::string text = noiseless("servo.toml", "2");
  const std::string age = "delay_s = 0.0005";
  ASSERT_NE(text.find(age), std::string::npos);
  text.replace(text.find(age), age.size(), "delay_s = 0");
  const auto run = test::run_text(text);
  PartialFractions servo = second_order(8.0L, 0.002, 0.15, 8.0L, 0, 0.0L);
  servo.delay_s = 0.002;
  expect_exact(run, first_sensor_channel, servo);
}

TEST(ExactnessOfAShippedFile, Chebyshev) {
  const auto run = test::run_text(noiseless("chebyshev.toml", "3"));
  const std::vector<long double> den{1.0L, 347.0L, 8987.0L, 317356.0L};
  expect_exact(run, first_sensor_channel,
               test::partial_fractions({309673.0L}, den, test::roots(den)));
}

// By hand: motor J1, b1; load J2, b2; shaft k, d. Den of both is J1 J2 s³ + …, expanded below.
TEST(ExactnessOfAShippedFile, TwoMass) {
  const auto run = test::run_text(noiseless("two-mass.toml", "11"));
  const long double j1 = 0.002L;
  const long double j2 = 0.004L;
  const long double b = 0.01L;
  const long double k = 200.0L;
  const long double d = 0.02L;
  // (j1 s² + (b + d) s + k)(j2 s² + (b + d) s + k) − (d s + k)², divided by s.
  const std::vector<long double> den{j1 * j2, (j1 + j2) * (b + d),
                                     (j1 + j2) * k + (b + d) * (b + d) - d * d,
                                     2.0L * (b + d) * k - 2.0L * d * k};
  const auto roots = test::roots(den);
  PartialFractions motor =
      test::partial_fractions({0.5L * j2, 0.5L * (b + d), 0.5L * k}, den, roots);
  PartialFractions load =
      test::partial_fractions(std::vector<long double>{0.5L * d, 0.5L * k}, den, roots);
  motor.delay_s = 0.00075;
  load.delay_s = 0.00075;
  expect_exact(run, first_sensor_channel, motor);
  expect_exact(run, first_sensor_channel + 1, load);
}

}  // namespace
}  // namespace sinerig
