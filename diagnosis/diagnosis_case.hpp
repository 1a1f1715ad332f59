// What a diagnosis is made of: a record, its replica, the declared machine, what may be wrong.
#pragma once

#include <vector>

#include "diagnosis/candidates/candidate.hpp"
#include "diagnosis/records/record.hpp"
#include "diagnosis/replica/replica.hpp"

namespace vcnc {

struct DiagnosisCase {
  const Record& record;
  Replica& replica;  ///< of the record
  const Machine& declared;
  std::vector<Candidate> candidates;
};

}  // namespace vcnc
