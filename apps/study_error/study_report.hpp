#pragma once

/// What `talus study error` puts on its page, and the tables behind it.

#include <string>
#include <vector>

#include "apps/shared/report_page.hpp"
#include "apps/study_error/study_problem.hpp"
#include "apps/study_error/study_profile.hpp"
#include "apps/study_error/study_runs.hpp"

namespace talus {

void report_problem(const ProblemStudy& study, const StudyPlan& plan, ReportPage& report);
void report_runs(const RunStudy& study, const StudyPlan& plan, ReportPage& report);
void report_profile(const std::vector<ProfileRow>& rows, ReportPage& report);

/// True for the names of files that `talus study error` may have written.
bool is_study_error_name(const std::string& name);

}  // namespace talus
