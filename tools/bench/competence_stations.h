// Of `stylet bench competence`: records that are killed, and many stations at one PostgreSQL server.
#pragma once

#include "tools/bench/report.h"

namespace stylet::bench {

/// A process that keeps attempts is killed outright, at random moments: what it said was kept is there, and whole.
void measure_kills(Report& report, int kills);

/// Eight stations, each a process, hand over to one server at once. On STYLET_TEST_POSTGRES, or a server that is
/// started for it; where there is none a note says so.
void measure_stations(Report& report, int attempts_each);

}  // namespace stylet::bench
