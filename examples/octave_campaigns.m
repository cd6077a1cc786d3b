% Campaigns from MATLAB or GNU Octave: a batch, d33 of the array, history. Needs a running service (`make serve`) and, for
% Octave, curl. UNDERSKIN_URL names another address. Run it in this folder: octave-cli octave_campaigns.m

url = getenv ('UNDERSKIN_URL');
if isempty (url)
  url = 'http://127.0.0.1:8000';
end

% A skin of two sensors. Lists are cells, { }: of a list of one, jsonencode would make a single value.
sensors = {struct('id', 's01', 'x_mm', 0, 'y_mm', 0), struct('id', 's02', 'x_mm', 8, 'y_mm', 0)};
skin = struct ('id', 'octave-palm', 'thickness_mm', 2.5, 'youngs_modulus_mpa', 16, 'poisson_ratio', 0.5, ...
               'sensor_radius_mm', 1.5);
skin.sensors = sensors;

% Three days; FRF at these frequencies, a row each sensor. On the last day the preload of s02 is typed wrongly.
frequency_hz = [10 20 40 80];
days = {'2017-05-03', '2017-06-03', '2017-07-03'};
frf_pc_per_n = cat (3, [7.41 7.39 7.38 7.40; 7.61 7.60 7.59 7.62], [7.36 7.37 7.35 7.36; 7.63 7.60 7.61 7.62], ...
                    [7.28 7.29 7.27 7.29; 7.60 7.62 7.61 7.63]);
preload_n = [1 1; 1 1; 1 -1];

batch = {};
for day = 1:numel (days)
  recordings = {};
  for sensor = 1:numel (sensors)
    recordings{end+1} = struct ('id', ['r' num2str(sensor)], 'sensor', sensors{sensor}.id, 'indenter_radius_mm', 4, ...
        'preload_n', preload_n(day,sensor), 'dynamic_force_n', 0.09, 'recorded_at', [days{day} 'T09:00:00Z'], ...
        'frequency_hz', frequency_hz, 'frf_re_pc_per_n', frf_pc_per_n(sensor,:,day), ...
        'frf_im_pc_per_n', zeros (size (frequency_hz)));
  end
  campaign = struct ('schema', 'campaign/1', 'name', days{day}, 'skin', skin);
  campaign.recordings = recordings;
  batch{end+1} = campaign;
end

answer = jsondecode (underskin_post ([url '/v1/campaigns'], jsonencode (batch), 'application/json', 'application/json'));
for day = 1:numel (days)
  for recording = answer.campaigns(day).recordings'
    fprintf ('%s %s: %s\n', days{day}, recording.id, recording.status);
    for refusal = recording.errors'
      fprintf ('  %s = %g: %s\n', refusal.field, refusal.value, refusal.allowed);
    end
  end
end

found = jsondecode (underskin_get ([url '/v1/campaigns/' answer.campaigns(1).id '/d33']));
fprintf ('d33 of the array = %.2f +- %.2f pC/N\n', found.array.d33_pc_per_n, found.array.d33_uncertainty_pc_per_n);

past = jsondecode (underskin_get ([url '/v1/skins/octave-palm/history']));
for number = 1:numel (past.sensors)
  values = [past.sensors(number).points.d33_pc_per_n];
  fprintf ('%s:%s pC/N\n', past.sensors(number).sensor, sprintf (' %.2f', values));
end
