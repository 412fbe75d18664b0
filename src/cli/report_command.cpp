#include <filesystem>
#include <ostream>
#include <sstream>

#include <spdlog/spdlog.h>

#include "cli/chosen_response.h"
#include "cli/commands.h"
#include "cli/output_file.h"
#include "report/figure.h"
#include "report/html.h"
#include "report/raster.h"

namespace sinerig::cli {

namespace {

namespace fs = std::filesystem;

constexpr double png_scale = 2.0;  // pixels per unit of the picture: sharp on paper

}  // namespace

int report_command(const ReportOptions& options) {
  if (options.format == "png" && !report::has_raster()) report::png_from_svg("", png_scale);
  const report::LabelledRun run{.label = fs::path{options.file}.stem().string(),
                                .run = record::read_sweep(options.file)};
  const std::string path =
      options.output.empty()
          ? fs::path{options.file}.replace_extension("." + options.format).string()
          : options.output;
  write_file(path, options.force || options.output.empty(), [&](std::ostream& stream) {
    if (options.format == "html") {
      write_html(stream, run);
      return;
    }
    const record::StoredResponse& response =
        chosen_response(run.run, options.file, options.channel);
    if (options.format == "svg") {
      write_bode_svg(stream, run, response);
      return;
    }
    std::ostringstream picture;
    write_bode_svg(picture, run, response);
    stream << report::png_from_svg(picture.str(), png_scale);
  });
  spdlog::info("wrote {}", path);
  return exit_done;
}

}  // namespace sinerig::cli
