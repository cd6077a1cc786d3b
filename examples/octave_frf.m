% FRF and d33 of a skin, from MATLAB or GNU Octave. Needs a running service (`make serve`) and, for Octave, curl.
% UNDERSKIN_URL names another address. Run it in this folder: octave-cli octave_frf.m

url = getenv ('UNDERSKIN_URL');
if isempty (url)
  url = 'http://127.0.0.1:8000';
end

% What should the prototype answer? JSON in, JSON out; the last preload is outside the table, so its row is NaN.
preload_n = [0.5 1 2 3 300];
request = struct ('thickness_mm', 2.5, 'youngs_modulus_mpa', 16, 'sensor_radius_mm', 1.5, ...
                  'indenter_radius_mm', 4, 'preload_n', preload_n, 'd33_pc_per_n', 14);
answer = jsondecode (underskin_post ([url '/v1/frf'], jsonencode (request), 'application/json', 'application/json'));
for row = 1:numel (preload_n)
  fprintf ('%5.1f N: FRF %.3f pC/N, %s\n', preload_n(row), answer.frf_pc_per_n(row), answer.status{row});
end

% What d33 do two measured FRFs mean? CSV in, CSV out: no JSON needed, so versions without jsondecode can do it too.
measured = [1 7.4; 3 11.5];
sheet = ['thickness_mm,youngs_modulus_mpa,sensor_radius_mm,indenter_radius_mm,' ...
         'preload_n,frf_pc_per_n,frf_uncertainty_pc_per_n' sprintf('\n2.5,16,1.5,4,%.17g,%.17g,0.1', measured')];
lines = strsplit (strtrim (underskin_post ([url '/v1/d33'], sheet, 'text/csv', 'text/csv')), {'\r\n', '\n'});
names = strsplit (lines{1}, ',');
d33 = find (strcmp (names, 'd33_pc_per_n'));
uncertainty = find (strcmp (names, 'd33_uncertainty_pc_per_n'));
for row = 2:numel (lines)
  cells = strsplit (lines{row}, ',');
  fprintf ('d33 = %.2f +- %.2f pC/N, %s\n', str2double (cells{d33}), str2double (cells{uncertainty}), cells{end});
end
