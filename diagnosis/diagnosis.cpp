#include "diagnosis/diagnosis.hpp"

namespace vcnc {

std::string_view to_string(DiagnosisVerdict verdict) {
  switch (verdict) {
    case DiagnosisVerdict::explained:
      return "EXPLAINED";
    case DiagnosisVerdict::partly:
      return "PARTLY";
    case DiagnosisVerdict::unexplained:
      return "UNEXPLAINED";
    case DiagnosisVerdict::no_deviation:
      return "NO DEVIATION";
    case DiagnosisVerdict::not_identifiable:
      return "NOT IDENTIFIABLE WITH THIS RUN";
    case DiagnosisVerdict::interrupted:
      return "INTERRUPTED";
  }
  return "";
}

}  // namespace vcnc
