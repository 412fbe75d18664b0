#include <atomic>
#include <cstdio>
#include <cstring>
#include <exception>
#include <string>
#include <thread>
#include <vector>

#include "quality.h"

namespace sinerig::quality {

void in_parallel(std::size_t count, unsigned threads,
                 const std::function<void(std::size_t)>& work) {
  std::atomic<std::size_t> next{0};
  const auto drain = [&] {
    for (std::size_t i = next++; i < count; i = next++) work(i);
  };
  std::vector<std::jthread> others;
  for (unsigned i = 1; i < threads; ++i) others.emplace_back(drain);
  drain();
}

namespace {

struct Part {
  const char* name;
  int (*run)(const Options&);
};

constexpr Part parts[] = {
    {"coverage", coverage}, {"transient", transient},  {"efficiency", efficiency}, {"bias", bias},
    {"time", bench_time},   {"tones", parallel_tones}, {"status", status},         {"cost", cost},
};

int usage() {
  std::fprintf(stderr,
               "quality [coverage|transient|efficiency|bias|time|tones|status|cost] [--seeds N] "
               "[--first-seed K] [--threads N]\nWithout a part: all of them.\n");
  return 2;
}

int run(int argc, char** argv) {
  Options options;
  options.rigs = SINERIG_SOURCE_DIR "/config/quality";
  std::vector<const Part*> chosen;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word.starts_with("--")) {
      if (i + 1 == argc) return usage();
      const auto value = std::stoull(argv[++i]);
      if (word == "--seeds") {
        options.seeds = static_cast<std::uint32_t>(value);
      } else if (word == "--first-seed") {
        options.first_seed = value;
      } else if (word == "--threads") {
        options.threads = static_cast<unsigned>(value);
      } else {
        return usage();
      }
      continue;
    }
    const auto known = chosen.size();
    for (const Part& part : parts) {
      if (word == part.name) chosen.push_back(&part);
    }
    if (chosen.size() == known) return usage();
  }
  if (chosen.empty()) {
    for (const Part& part : parts) chosen.push_back(&part);
  }
  int missed = 0;
  for (const Part* part : chosen) missed += part->run(options);
  std::printf("\n%d bound%s missed\n", missed, missed == 1 ? "" : "s");
  return missed == 0 ? 0 : 1;
}

}  // namespace
}  // namespace sinerig::quality

int main(int argc, char** argv) {
  try {
    return sinerig::quality::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "quality: %s\n", error.what());
    return 1;
  }
}
