#include "cli/night_job.h"

#include <cstdio>
#include <filesystem>
#include <set>

namespace sinerig::cli {

namespace {

namespace fs = std::filesystem;
using config::Section;

std::string beside(const std::string& file, const std::string& path) {
  const fs::path folder = fs::path{file}.parent_path();
  return fs::path{path}.is_absolute() ? path : (folder / path).lexically_normal().string();
}

int read_time_of_day(const Section& section, const std::string& text) {
  int hour = -1;
  int minute = -1;
  int length = 0;
  const int read = std::sscanf(text.c_str(), "%2d:%2d%n", &hour, &minute, &length);
  const bool whole = static_cast<std::size_t>(length) == text.size();
  if (read != 2 || !whole || hour < 0 || hour > 23 || minute < 0 || minute > 59) {
    section.refuse("start_at", "must be a local time of day, \"22:30\"");
  }
  return 3600 * hour + 60 * minute;
}

// A name becomes the name of a file.
std::string read_name(const Section& section, const std::string& rig) {
  std::string name = section.text("name", fs::path{rig}.stem().string());
  constexpr const char* letters =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-";
  if (name.empty() || name.find_first_not_of(letters) != std::string::npos) {
    section.refuse("name", "must be letters, digits, _ and -: the sweep files are named after it");
  }
  return name;
}

NightSweep read_sweep(const Section& section, const std::string& file) {
  const std::string rig = section.text("rig");
  NightSweep sweep{.name = read_name(section, rig),
                   .rig = beside(file, rig),
                   .second_of_day = {},
                   .start_after_s = {},
                   .overrides = {}};
  sweep.repeat = static_cast<int>(section.integer("repeat", {.min = 1.0, .max = 1000.0}, 1));
  sweep.pause_s = section.number("pause_s", {.min = 0.0, .max = 1e6}, 0.0);
  if (section.has("start_at")) {
    sweep.second_of_day = read_time_of_day(section, section.text("start_at"));
  }
  if (section.has("start_after_s")) {
    sweep.start_after_s = section.number("start_after_s", {.min = 0.0, .max = 1e6});
  }
  if (const auto set = section.table("set")) sweep.overrides = set->values();
  return sweep;
}

// `number` from 0.
void note_places(NightSweep& sweep, std::size_t number, const config::RigFile& file) {
  const std::string path = "night.sweep[" + std::to_string(number) + "].";
  const auto line = [&](const std::string& key) {
    return config::line_of(file.text(), file.name(), path + key);
  };
  sweep.job = file.name();
  sweep.rig_line = line("rig");
  for (const auto& [key, value] : sweep.overrides)
    sweep.override_lines.push_back(line("set." + key));
}

std::string place_in_job(const NightSweep& sweep, std::size_t line) {
  return sweep.job + ":" + std::to_string(line) + ": ";
}

bool speaks_of(const std::string& message, const std::string& path) {
  const std::size_t dot = path.rfind('.');
  if (dot == std::string::npos) return false;
  const std::string section = std::string{"["}.append(path, 0, dot).append("]");
  const std::string key = section + " " + path.substr(dot + 1);
  for (const std::string& words : {key + " = ", key + ": ", section + ": unknown section"}) {
    if (message.find(": " + words) != std::string::npos) return true;
  }
  return false;
}

}  // namespace

std::string at_its_place(const NightSweep& sweep, const std::string& message) {
  for (std::size_t i = 0; i < sweep.overrides.size(); ++i) {
    if (!speaks_of(message, sweep.overrides[i].first)) continue;
    return place_in_job(sweep, sweep.override_lines[i]) + message.substr(message.find(": [") + 2) +
           " (set for " + sweep.rig + ")";
  }
  if (sweep.overrides.empty()) return message;
  return message + " (counted with the lines that " + sweep.job + " adds)";
}

NightJob read_night_job(const std::string& path) {
  const std::unique_ptr<config::RigFile> file = config::RigFile::load(path);
  const Section night = file->section("night");
  NightJob job{.file = path,
               .folder = beside(path, night.text("folder", fs::path{path}.stem().string())),
               .compare = {},
               .sweeps = {}};
  job.stop_on_stop = night.choice("on_stop", {"next", "stop"}) == "stop";
  job.compare.tolerance_db = night.number("tolerance_db", config::zero_or_more, 0.0);
  job.compare.tolerance_deg = night.number("tolerance_deg", config::zero_or_more, 0.0);
  job.compare.false_alarm = night.number("false_alarm", {.min = 1e-12, .max = 0.5}, 0.01);
  std::set<std::string> names;
  for (const Section& section : night.tables("sweep")) {
    job.sweeps.push_back(read_sweep(section, path));
    note_places(job.sweeps.back(), job.sweeps.size() - 1, *file);
    if (names.insert(job.sweeps.back().name).second) continue;
    section.refuse(section.has("name") ? "name" : "rig",
                   "\"" + job.sweeps.back().name +
                       "\" is the name of an earlier sweep; give this one another with name = …");
  }
  if (job.sweeps.empty()) night.refuse("sweep", "is missing; add a section [[night.sweep]]");
  file->refuse_unread();
  return job;
}

std::vector<NightTask> tasks_of(const NightJob& job) {
  std::vector<NightTask> tasks;
  for (const NightSweep& sweep : job.sweeps) {
    if (!fs::exists(sweep.rig)) {
      throw config::ConfigError(place_in_job(sweep, sweep.rig_line) + "[night.sweep] rig: " +
                                sweep.rig + ": cannot be read; is the path right?");
    }
    std::string text = config::RigFile::load(sweep.rig)->text();
    for (std::size_t i = 0; i < sweep.overrides.size(); ++i) {
      const std::string place = sweep.job + ":" + std::to_string(sweep.override_lines[i]);
      text = config::with_overrides(text, place, {sweep.overrides[i]});
    }
    const std::unique_ptr<config::RigFile> edited = config::RigFile::parse(text, sweep.rig);
    const std::optional<Section> plant = edited->find("plant");
    for (int repeat = 1; repeat <= sweep.repeat; ++repeat) {
      NightTask task{.sweep = &sweep,
                     .repeat = repeat,
                     .sweep_file = (fs::path{job.folder} /
                                    (sweep.name + "-" + std::to_string(repeat) + ".sweep"))
                                       .string(),
                     .rig_text = text};
      if (plant && repeat > 1) {
        const std::int64_t seed =
            of_sweep(sweep, [&] { return plant->integer("seed", {.min = 0.0, .max = 9e15}, 1); });
        task.rig_text = config::with_overrides(text, sweep.rig,
                                               {{"plant.seed", std::to_string(seed + repeat - 1)}});
      }
      tasks.push_back(std::move(task));
    }
  }
  return tasks;
}

}  // namespace sinerig::cli
