#pragma once

#include <optional>
#include <string>

namespace talus {

/// `talus view` and `talus movie`: frames of a run as images.
struct ViewCommandOptions {
  std::string run;                                     ///< directory of the results
  std::string colour = "speed";                        ///< io::grain_colours()
  int width = 960;                                     ///< [px]
  std::optional<double> azimuth = {}, elevation = {};  ///< [degrees]; none: io::Camera, or along the slice
  std::string slice;                                   ///< "x", "y" or "z"; "": the whole sample
  int frame = -1;                                      ///< of a view; < 0: counted from the last
  int rate = 25;                                       ///< of a movie: frames a second
  std::string out;     ///< "": view.png, or the directory movie, in that of the run
  bool force = false;  ///< replace what is there
};

/// Writes one frame as PNG or, with its scale of colours, as SVG where `out` ends with .svg. Returns an
/// ExitCode.
int view_command(const ViewCommandOptions& options);

/// Writes all frames as PNG, in one scale of colours and places, and joins them to movie.mp4 where there is
/// an ffmpeg. Returns an ExitCode.
int movie_command(const ViewCommandOptions& options);

}  // namespace talus
