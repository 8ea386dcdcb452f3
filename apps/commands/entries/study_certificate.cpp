#include "apps/study_certificate/study_certificate.hpp"
#include "apps/commands/commands.hpp"

namespace talus {

Command study_certificate_entry() {
  return command<StudyCertificateOptions>(
      "certificate", "true errors of certified steps against what they claim, on scenes by the thousand",
      add_study_certificate_options,
      [](StudyCertificateOptions& options, CommandLine) { return study_certificate_command(options); });
}

}  // namespace talus
