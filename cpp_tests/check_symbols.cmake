# No program built with the drop-in defines a symbol of pcl::IntegralImageNormalEstimation; it uses libiine's.
#   cmake -D NM=nm -D FILE=<program> -P check_symbols.cmake
execute_process(COMMAND ${NM} -C ${FILE} OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "[^\n]* [TWVBDRuw] [^\n]*pcl::IntegralImageNormalEstimation<[^\n]*" defined "${symbols}")
list(FILTER defined EXCLUDE REGEX "iine::")
if(defined)
  message(FATAL_ERROR "defines PCL's class:\n${defined}")
endif()
if(NOT symbols MATCHES "iine_estimator_compute")
  message(FATAL_ERROR "does not use libiine")
endif()
