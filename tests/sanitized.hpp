// Builds with a sanitizer are ten times slower and take fewer cases.
#pragma once

namespace vcnc {

#ifdef VCNC_SANITIZED
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace vcnc
