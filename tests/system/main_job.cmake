# The whole main job and the trouble it must survive: real processes, real time; each runs alone.
foreach(script main_job_test kill_each_process_test plant_walls_test file_to_part_test)
  if(EXISTS ${CMAKE_CURRENT_LIST_DIR}/${script}.py)
    add_test(NAME system_${script} COMMAND /usr/bin/python3 ${CMAKE_CURRENT_LIST_DIR}/${script}.py ${CMAKE_BINARY_DIR})
    set_tests_properties(system_${script} PROPERTIES LABELS system TIMEOUT 900 RUN_SERIAL TRUE
      ENVIRONMENT "LAMBDAJET_PYTHON_STUBS=${CMAKE_BINARY_DIR}/python")
  endif()
endforeach()
