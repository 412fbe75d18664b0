// Rig files as text: written to a file of their own, run, edited by key.
#pragma once

#include <fstream>
#include <iterator>
#include <regex>
#include <string>

#include <gtest/gtest.h>

#include "cli/configured_rig.h"
#include "sim/sim_driver.h"
#include "support/own_file.h"
#include "support/virtual_run.h"

namespace sinerig::test {

inline std::string text_of(const std::string& path) {
  std::ifstream stream{path, std::ios::binary};
  EXPECT_TRUE(stream) << path;
  return {std::istreambuf_iterator<char>{stream}, {}};
}

inline void write_text(const std::string& path, const std::string& text) {
  std::ofstream stream{path, std::ios::binary};
  stream << text;
  ASSERT_TRUE(stream.flush()) << path;
}

inline std::string shipped(const std::string& name) {
  return std::string{SINERIG_SOURCE_DIR} + "/config/" + name;
}

// Every line that sets `key`, wherever it stands, replaced.
inline std::string with_key(const std::string& text, const std::string& key,
                            const std::string& value) {
  const std::regex line{"(^|\n)" + key + " *=[^\n]*"};
  EXPECT_TRUE(std::regex_search(text, line)) << key;
  return std::regex_replace(text, line, "$01" + key + " = " + value);
}

// The text without the lines that set any of `keys`.
inline std::string without_keys(std::string text, std::initializer_list<const char*> keys) {
  for (const char* key : keys) {
    text = std::regex_replace(text, std::regex{"(^|\n)" + std::string{key} + " *=[^\n]*"}, "$01");
  }
  return text;
}

struct ConfiguredRun {
  SweepPlan plan;
  CollectingSink sink;
  RunOutcome outcome;
};

// From the text of a rig file to the points, through everything but the recorder.
inline ConfiguredRun run_text(const std::string& text) {
  const std::string path = own_file("rig.toml");
  write_text(path, text);
  cli::ConfiguredRig configured{path, {sim::sim_driver()}};
  ConfiguredRun run;
  run.plan = configured.rig().plan();
  configured.open();
  Guard guard{configured.rig().guard, configured.clock().grid().period_s()};
  SweepRunner runner{
      run.plan, {},      configured.clock(), configured.actuator(), configured.sensors(),
      guard,    run.sink};
  RunControl control;
  run.outcome = runner.run(control);
  return run;
}

}  // namespace sinerig::test
