#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "parts.h"
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

constexpr bench::Part<Options> parts[] = {
    {"coverage", coverage}, {"transient", transient},  {"efficiency", efficiency}, {"bias", bias},
    {"time", bench_time},   {"tones", parallel_tones}, {"status", status},         {"cost", cost},
};

constexpr const char* usage =
    "quality [coverage|transient|efficiency|bias|time|tones|status|cost] [--seeds N] "
    "[--first-seed K] [--threads N]\nWithout a part: all of them.\n";

bool option(const std::string& word, bench::Words& words, Options& options) {
  if (word == "--seeds") {
    options.seeds = static_cast<std::uint32_t>(std::stoul(words.take()));
  } else if (word == "--first-seed") {
    options.first_seed = std::stoull(words.take());
  } else if (word == "--threads") {
    options.threads = static_cast<unsigned>(std::stoul(words.take()));
  } else {
    return false;
  }
  return true;
}

}  // namespace
}  // namespace sinerig::quality

int main(int argc, char** argv) {
  using namespace sinerig;
  quality::Options options;
  options.rigs = SINERIG_SOURCE_DIR "/config/quality";
  return bench::run_parts<quality::Options>(argc, argv, quality::parts, options, quality::option,
                                            quality::usage);
}
