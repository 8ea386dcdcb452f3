#include "apps/commands/convert.hpp"
#include "apps/commands/commands.hpp"

namespace talus {

namespace {

void add_options(CLI::App& app, ConvertOptions& options) {
  app.add_option("run", options.run, "directory of the results, or a results.h5")
      ->type_name("DIR")
      ->required();
  app.add_option("--to", options.format, "lammps (a dump, for OVITO and LAMMPS) or vtkhdf (ParaView 5.12)")
      ->type_name("FORMAT")
      ->required();
  app.add_option("-o,--out", options.out, "file [grains.lammpstrj or grains.vtkhdf in the directory]")
      ->type_name("FILE");
  app.add_flag("--force", options.force, "replace the file where it is there");
}

int run(ConvertOptions& options, CommandLine) {
  return convert_command(options);
}

}  // namespace

Command convert_entry() {
  return command<ConvertOptions>("convert", "write the frames of a run for other programs", add_options, run);
}

}  // namespace talus
