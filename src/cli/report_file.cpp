#include "cli/report_file.h"

#include <filesystem>
#include <fstream>
#include <ostream>

#include "cli/measured_run.h"
#include "cli/output_file.h"
#include "report/html.h"

namespace sinerig::cli {

namespace fs = std::filesystem;

std::string report_path(const std::string& sweep_file) {
  return fs::path{sweep_file}.replace_extension(".html").string();
}

bool is_report(const std::string& path) {
  std::ifstream stream{path};
  std::string head(512, '\0');
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  return head.find("<meta name=\"generator\" content=\"sinerig ") != std::string::npos;
}

void write_report(const std::string& sweep_file, const std::string& path, bool force,
                  const nlohmann::ordered_json& loop) {
  const report::LabelledRun run{.label = fs::path{sweep_file}.stem().string(),
                                .run = read_run(sweep_file)};
  write_file(path, force || is_report(path),
             [&](std::ostream& stream) { report::write_html(stream, run, loop); });
}

}  // namespace sinerig::cli
