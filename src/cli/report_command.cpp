#include <filesystem>
#include <ostream>
#include <sstream>

#include <nlohmann/json.hpp>
#include <spdlog/spdlog.h>

#include "cli/chosen_response.h"
#include "cli/commands.h"
#include "cli/loop_panel.h"
#include "cli/measured_run.h"
#include "cli/output_file.h"
#include "cli/report_file.h"
#include "report/figure.h"
#include "report/raster.h"

namespace sinerig::cli {

namespace {

namespace fs = std::filesystem;

constexpr double png_scale = 2.0;  // pixels per unit of the picture: sharp on paper

}  // namespace

int report_command(const ReportOptions& options) {
  refuse_input(options.output, {options.file});
  if (options.format == "html") {
    const std::string path = options.output.empty() ? report_path(options.file) : options.output;
    // The page shows every sensor, but a name that is none is a slip.
    if (!options.channel.empty())
      chosen_response(read_run(options.file), options.file, options.channel);
    // First, because a model that has to be fitted goes into the sweep file that is reported.
    const nlohmann::ordered_json loop =
        has_controller(options.loop) ? loop_panel(options.file, options.channel, options.loop)
                                     : nlohmann::ordered_json{};
    write_report(options.file, path, options.force, loop);
    spdlog::info("wrote {}", path);
    return exit_done;
  }
  if (options.format == "png" && !report::has_raster()) report::png_from_svg("", png_scale);
  const report::LabelledRun run{.label = fs::path{options.file}.stem().string(),
                                .run = read_run(options.file)};
  const std::string path =
      options.output.empty()
          ? fs::path{options.file}.replace_extension("." + options.format).string()
          : options.output;
  std::ostringstream picture;
  write_bode_svg(picture, run, chosen_response(run.run, options.file, options.channel));
  write_file(path, options.force, [&](std::ostream& stream) {
    stream << (options.format == "png" ? report::png_from_svg(picture.str(), png_scale)
                                       : picture.str());
  });
  spdlog::info("wrote {}", path);
  return exit_done;
}

}  // namespace sinerig::cli
