#include "apps/commands/commands.hpp"
#include "apps/commands/view_command.hpp"
#include "apps/shared/options.hpp"

namespace talus {

namespace {

void add_common(CLI::App& app, ViewCommandOptions& options) {
  app.add_option("run", options.run, "directory of the results")->type_name("DIR")->required();
  app.add_option("--colour", options.colour,
                 "what grains are coloured by: speed, velocity_x, velocity_y, velocity_z, radius, force or "
                 "material")
      ->type_name("WHAT")
      ->capture_default_str();
  app.add_option("--width", options.width, "of the image [px]")
      ->type_name("N")
      ->check(CLI::Range(64, 8192))
      ->capture_default_str();
  app.add_option(
         "--slice", options.slice,
         "x, y or z: only grains about the middle of all centres of the frame along this axis, four mean "
         "radii thick, seen along it")
      ->type_name("AXIS");
  app.add_option("--azimuth", options.azimuth, "where one looks from, degrees from x towards y [-60]")
      ->type_name("DEG");
  app.add_option("--elevation", options.elevation, "degrees above the plane of x and y [20]")
      ->type_name("DEG")
      ->check(CLI::Range(-90, 90));
  app.add_flag("--force", options.force, "replace what is there");
}

void add_view_options(CLI::App& app, ViewCommandOptions& options) {
  add_common(app, options);
  app.add_option("--frame", options.frame, "from 0; below 0 counted from the last")
      ->type_name("N")
      ->capture_default_str();
  app.add_option("-o,--out", options.out,
                 "a .png, or a .svg, which shows the scale of colours, too [view.png in the directory]")
      ->type_name("FILE");
}

void add_movie_options(CLI::App& app, ViewCommandOptions& options) {
  add_common(app, options);
  app.add_option("--rate", options.rate, "frames a second of the film")
      ->type_name("N")
      ->check(CLI::Range(1, 120))
      ->capture_default_str();
  app.add_option("-o,--out", options.out, "directory [movie in that of the run]")->type_name("DIR");
}

}  // namespace

Command view_entry() {
  return command<ViewCommandOptions>(
      "view", "draw a frame of a run in space, as an image", add_view_options,
      [](ViewCommandOptions& options, CommandLine) { return view_command(options); });
}

Command movie_entry() {
  return command<ViewCommandOptions>(
      "movie", "draw all frames of a run as images, and as a film where there is ffmpeg", add_movie_options,
      [](ViewCommandOptions& options, CommandLine) { return movie_command(options); });
}

}  // namespace talus
