-- GET /v1/sigma with a new a/h each time, over the whole axis.
local count = 0
request = function()
  count = count + 1
  local a = 0.01 + (count % 299) * 0.01
  return wrk.format("GET", wrk.path .. "?a_over_h=" .. a .. "&rt_over_h=0.6&load_parameter=0.01")
end
