// Student's t distribution: what few points leave unknown.
#pragma once

namespace stylet::lab::statistics {

/// t with P(|T| <= t) = `confidence`. @param freedom  degrees of freedom, at least 1
double student_t(double confidence, int freedom);

}  // namespace stylet::lab::statistics
