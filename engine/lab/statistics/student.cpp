#include "engine/lab/statistics/student.h"

#include <boost/math/distributions/students_t.hpp>

namespace stylet::lab::statistics {

double student_t(double confidence, int freedom) {
  return boost::math::quantile(boost::math::students_t(freedom), 0.5 + confidence / 2);
}

}  // namespace stylet::lab::statistics
