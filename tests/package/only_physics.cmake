# Included by project(): finds what the physics needs and fails where anything else is looked for.
macro(find_only_physics method package)
  if(NOT "${package}" MATCHES "^(Threads|Eigen3|fmt|GTest)$")
    message(FATAL_ERROR "STYLET_BUILD=physics looks for ${package}")
  endif()
endmacro()
cmake_language(SET_DEPENDENCY_PROVIDER find_only_physics SUPPORTED_METHODS FIND_PACKAGE)
